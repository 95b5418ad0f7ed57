//! Algorithms that fit a model to measurements. Nothing here knows a robot: each algorithm is tested on published
//! problems (MINPACK, Rosenbrock) and serves whatever implements [`problem::Problem`].

pub mod problem;
pub mod least_squares;
pub mod chaos;
