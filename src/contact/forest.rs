//! Which trees hang together.

/// Disjoint sets of trees. The lowest tree of a set stands for it, whatever the order of the joins.
#[derive(Clone, Debug, Default)]
pub struct Forest {
    parent: Vec<usize>,
}

impl Forest {
    /// n trees, each on its own.
    pub fn reset(&mut self, n: usize) {
        self.parent.clear();
        self.parent.extend(0..n);
    }

    pub fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b)] = a.min(b);
    }

    /// The lowest tree of the set; shortens the way there.
    pub fn find(&mut self, mut t: usize) -> usize {
        while self.parent[t] != t {
            self.parent[t] = self.parent[self.parent[t]];
            t = self.parent[t];
        }
        t
    }
}
