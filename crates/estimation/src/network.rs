//! Networks: smooth functions with many weights and no physics.
//!
//! | file | method | passes |
//! |---|---|---|
//! | [`rbf`] | radial basis functions, linear in their weights | one Jacobian pass |

pub mod rbf;
