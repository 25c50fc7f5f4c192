use super::World;
use crate::language::Program;

/// What a reranker looks at when it chooses between programs.
pub trait Features: World {
    /// How many numbers [`Features::features`] returns.
    fn feature_count(&self) -> usize;

    /// The state features of a program in a scene.
    ///
    /// - returns: `[feature_count]`, each between -1 and 1; no unit.
    fn features(&self, scene: &Self::Scene, program: &Program) -> Vec<f32>;
}
