//! What is known at a point of a program, joined where paths meet.

/// Facts that hold on several paths: an element of a join semi-lattice.
pub(crate) trait Lattice: Clone {
    /// Joins the facts of another path.
    fn join(&mut self, other: &Self);
}

/// `None`: nothing arrives here.
impl<F: Lattice> Lattice for Option<F> {
    fn join(&mut self, other: &Self) {
        match (self, other) {
            (Some(fact), Some(other)) => fact.join(other),
            (this @ None, other) => this.clone_from(other),
            (Some(_), None) => {}
        }
    }
}
