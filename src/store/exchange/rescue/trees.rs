use std::collections::BTreeMap;

use crate::ids::TenantId;
use crate::store::sled::tenant_of_tree;

/// Where something stands in the database's history; none where a segment's header is damaged, which
/// then counts as oldest.
type Lsn = Option<u64>;

/// What a scan says of the way from the trees' names to their pages: the newest word on each.
#[derive(Default)]
pub(super) struct Ways {
    roots: (Lsn, Vec<(TenantId, u64)>),
    pages: BTreeMap<u64, (Lsn, Vec<u64>)>,
}

/// In which lab's tree each page stands. Says nothing of pages to which no way leads any more.
#[derive(Default)]
pub(super) struct Trees {
    tenants: Vec<TenantId>,
    /// By page, the place in `tenants`.
    pages: BTreeMap<u64, usize>,
}

impl Ways {
    pub(super) fn roots(&mut self, lsn: Lsn, roots: &[(&[u8], u64)]) {
        if lsn >= self.roots.0 {
            let named = |&(name, page): &(&[u8], u64)| Some((tenant_of_tree(name)?, page));
            self.roots = (lsn, roots.iter().filter_map(named).collect());
        }
    }

    pub(super) fn page(&mut self, lsn: Lsn, page: u64, leads_to: Vec<u64>) {
        let known = self.pages.entry(page).or_default();
        if lsn >= known.0 {
            *known = (lsn, leads_to);
        }
    }

    pub(super) fn walk(self) -> Trees {
        let mut trees = Trees::default();
        for (tenant, root) in self.roots.1 {
            let tree = trees.tenants.len();
            trees.tenants.push(tenant);
            let mut waiting = vec![root];
            while let Some(page) = waiting.pop() {
                if trees.pages.contains_key(&page) {
                    continue;
                }
                trees.pages.insert(page, tree);
                let below = self.pages.get(&page).map(|(_, below)| below);
                waiting.extend(below.into_iter().flatten());
            }
        }
        trees
    }
}

impl Trees {
    pub(super) fn tenant_of(&self, page: u64) -> Option<&TenantId> {
        self.pages.get(&page).map(|&tree| &self.tenants[tree])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn name(tenant: &str) -> Vec<u8> {
        format!("events/{tenant}").into_bytes()
    }

    #[test]
    fn a_page_is_of_the_tree_whose_name_leads_to_it_by_the_newest_way() {
        let mut ways = Ways::default();
        let (one, two) = (name("one"), name("two"));
        ways.roots(Some(5), &[(&one, 2), (&two, 4), (b"another", 6)]);
        ways.page(Some(1), 2, vec![3]);
        ways.page(Some(5), 4, vec![5]);
        ways.page(Some(9), 2, vec![3, 7]);
        // An older copy that comes later in the file, and the place in a damaged segment.
        ways.page(Some(3), 4, vec![8]);
        ways.page(None, 4, vec![9]);
        ways.roots(None, &[]);
        // Leaves know their neighbours, and a circle ends.
        ways.page(Some(4), 7, vec![10, 2]);
        // Given up.
        ways.page(Some(4), 5, vec![11]);
        ways.page(Some(6), 5, Vec::new());
        let trees = ways.walk();
        let found = |page| trees.tenant_of(page).map(TenantId::as_str);
        let of = |tree: &str| (2..12).filter(|&page| found(page) == Some(tree)).collect::<Vec<_>>();
        assert_eq!((of("one"), of("two")), (vec![2, 3, 7, 10], vec![4, 5]));
        assert_eq!([6, 8, 9, 11].map(found), [None; 4]);
    }
}
