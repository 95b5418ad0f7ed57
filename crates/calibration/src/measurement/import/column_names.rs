//! Names of the columns of a measurement table.

/// The measured point.
pub(super) const POSITION: [&str; 3] = ["measured_x", "measured_y", "measured_z"];
/// The measured orientation.
pub(super) const QUATERNION: [&str; 4] = ["measured_qw", "measured_qx", "measured_qy", "measured_qz"];

/// The controller's own read-out.
pub(super) const READOUT: [&str; 3] = ["x", "y", "z"];

/// The centre of mass of the payload.
pub(super) const PAYLOAD_CENTRE: [&str; 3] = ["payload_x", "payload_y", "payload_z"];

/// The sampling point of a row on a path.
pub(super) const PATH: [&str; 3] = ["path", "cycle", "sample"];

/// Prefixes of joint names: `q1`, as here, or `J1`, as controllers show it.
pub(super) const LETTERS: [char; 2] = ['q', 'J'];

/// The joint that a header names.
pub(super) fn joint(name: &str) -> Option<usize> {
    LETTERS.into_iter().find_map(|letter| joint_number(name, letter))
}

/// The joint that a header names by this letter.
pub(super) fn joint_number(name: &str, letter: char) -> Option<usize> {
    let digits = name.strip_prefix(letter)?;
    (digits.len() <= 2 && digits.bytes().all(|b| b.is_ascii_digit()))
        .then(|| digits.parse().ok())?
        .filter(|n| *n > 0)
}
