use linfa_nn::distance::L2Dist;
use linfa_nn::{LinearSearch, NearestNeighbour};
use ndarray::{Array2, ArrayView1};

use super::TrainFault;
use crate::numerics::distance;

/// The embeddings of all exemplars.
///
/// `linfa-nn` finds the exemplars in range. It borrows its points, so a view is opened for each
/// query. It promises no order, and sums distances in its own order. So the range is a little wider
/// than asked, and the distances of what it finds are computed again with our kernel and sorted by
/// (distance, exemplar number).
#[derive(Debug, Clone)]
pub(super) struct ExemplarIndex {
    points: Array2<f32>,
}

/// How much wider the range is, relative and absolute: far above the rounding of either sum.
const WIDER: (f32, f32) = (1.001, 1e-4);

impl ExemplarIndex {
    /// - `points`: `[exemplars × width]`.
    /// - errors: a point is not finite, so it has no distance.
    pub(super) fn new(width: usize, points: Vec<f32>) -> Result<ExemplarIndex, TrainFault> {
        if points.iter().any(|x| !x.is_finite()) {
            let reason = "an exemplar's embedding is not finite".to_owned();
            return Err(TrainFault::Weights { reason });
        }
        let rows = points.len() / width;
        let points = Array2::from_shape_vec((rows, width), points)
            .expect("whole rows of the network's width");
        Ok(ExemplarIndex { points })
    }

    /// Every exemplar within `range` of the query, and the `nearest` ones even if they are outside:
    /// (exemplar number, distance), nearest first. Among equals, the older exemplar comes first.
    pub(super) fn near(&self, query: &[f32], range: f32, nearest: usize) -> Vec<(u32, f32)> {
        if query.iter().any(|x| !x.is_finite()) {
            return Vec::new();
        }
        let view = LinearSearch::new()
            .from_batch(&self.points, L2Dist)
            .expect("an index of at least one column");
        let point = ArrayView1::from(query);
        let few = view.k_nearest(point, nearest).expect("a query of the network's width");
        let reach =
            few.iter().map(|&(_, number)| self.distance(query, number)).fold(range, f32::max);
        let found = view
            .within_range(point, reach * WIDER.0 + WIDER.1)
            .expect("a query of the network's width");
        let mut found: Vec<(u32, f32)> = found
            .iter()
            .map(|&(_, number)| (number as u32, self.distance(query, number)))
            .collect();
        found.sort_by(|one, two| one.1.total_cmp(&two.1).then(one.0.cmp(&two.0)));
        let within = found.partition_point(|&(_, distance)| distance <= range);
        found.truncate(within.max(nearest));
        found
    }

    /// Every exemplar with its distance, in order of number.
    pub(super) fn every(&self, query: &[f32]) -> impl Iterator<Item = (u32, f32)> {
        (0..self.points.nrows()).map(move |number| (number as u32, self.distance(query, number)))
    }

    fn distance(&self, query: &[f32], number: usize) -> f32 {
        let row = self.points.row(number);
        distance(query, row.to_slice().expect("rows of a standard layout"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numerics::Rng;

    #[test]
    fn it_finds_what_a_plain_scan_finds_in_the_same_order() {
        let seed = 17;
        println!("seed {seed}");
        let mut rng = Rng::from_u64(seed);
        let width = 12;
        let mut points: Vec<f32> = (0..40 * width).map(|_| rng.normal()).collect();
        // Equal points: only the number can order them.
        for copy in 20..30 {
            points.copy_within(0..width, copy * width);
        }
        let index = ExemplarIndex::new(width, points.clone()).unwrap();
        for range in [0.0, 1.0, 4.0, 9.0] {
            let query: Vec<f32> = match range {
                0.0 => points[..width].to_vec(),
                _ => (0..width).map(|_| rng.normal()).collect(),
            };
            let mut expected: Vec<(u32, f32)> = points
                .chunks_exact(width)
                .enumerate()
                .map(|(number, row)| (number as u32, distance(&query, row)))
                .collect();
            expected.sort_by(|one, two| one.1.total_cmp(&two.1).then(one.0.cmp(&two.0)));
            let within = expected.iter().filter(|near| near.1 <= range).count();
            expected.truncate(within.max(3));
            assert_eq!(index.near(&query, range, 3), expected, "range {range}");
        }
    }

    #[test]
    fn a_point_that_is_no_number_is_refused() {
        assert!(ExemplarIndex::new(2, vec![0.0, f32::NAN]).is_err());
        let index = ExemplarIndex::new(2, vec![0.0, 1.0]).unwrap();
        assert!(index.near(&[f32::NAN, 0.0], 1.0, 3).is_empty());
    }
}
