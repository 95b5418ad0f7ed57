//! Names of the columns of a measurement table.

/// The measured point.
pub(super) const POSITION: [&str; 3] = ["measured_x", "measured_y", "measured_z"];
/// The measured orientation.
pub(super) const QUATERNION: [&str; 4] = ["measured_qw", "measured_qx", "measured_qy", "measured_qz"];

/// The controller's own read-out.
pub(super) const READOUT: [&str; 3] = ["x", "y", "z"];

/// The sampling point of a row on a path.
pub(super) const PATH: [&str; 3] = ["path", "cycle", "sample"];
