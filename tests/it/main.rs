//! The one integration-test binary; its modules mirror `src/`.

mod program;
mod surface;
mod estimation;
mod robots;
mod kinematics;
mod measurement;
mod identification;
mod compensation;
mod planning;
mod report;
mod visual;
mod command;
mod layers;
