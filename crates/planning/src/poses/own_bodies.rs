//! The arm's own bodies, which its wrist, its flange and the target must keep off, and a cable or a line of sight too.
//!
//! **What it rests on.** A data sheet states joint axes, not shapes. So the bodies are assumed: capsules about lines between the joints.
//! - *Column*: the vertical part on axis 1 from the base up to the height of axis 2, with the stated radius, and from there to axis 2, where
//!   that stands beside axis 1. The forearm, the wrist, the flange and the target keep off it.
//! - *Upper arm*, half the radius: the wrist, the flange and the target keep off it.
//! - *Forearm* up to the wrist, half the radius: the flange and the target keep off it. The makers of arms let the wrist bend until the
//!   flange is close to the forearm: no distance above a share ([`BENT`]) of that of the flange from the wrist is asked for.
//!
//! What moves has half the radius. Neighbours are left to the limits of the joints between them. Where axes are parallel, the sheet does
//! not say on which side along them a link lies; its centre of mass does, if stated, and the link is then assumed there too.
//! Covers, cables, hoses and motors that stand out are not known.
//!
//! **Checked against** the joints of measured arms (UR5, UR10, IRB 120), every published pose of the catalogue and usual home poses: none of
//! them is a collision.

use nalgebra::Vector3;

use super::setup::MeasurementSetup;
use truegrind_arm::chain::Chain;

/// A line between two points (mm, base).
pub(super) type Line = [Vector3<f64>; 2];

/// The arm's own bodies that something can run into.
pub(super) const BODIES: usize = 3;

/// Two lines at most for each: along the axis and beside it, or between the axes and where the centre of mass lies.
pub(super) type Lines = [[Line; 2]; BODIES];

/// The first joint that moves other parts against each body: a column looks the same from all sides, and turns with joint 1.
pub(super) const FIRST_JOINT: [usize; BODIES] = [1, 2, 3];

/// Share of the distance between wrist and flange that is always allowed between flange and forearm: the sine of 135°.
const BENT: f64 = 0.7;

/// Axes are parallel if the sine of their angle is below.
const PARALLEL: f64 = 1e-3;

/// What the sheet says of an arm's bodies.
#[derive(Debug, Clone, Copy)]
pub(super) struct OwnBodies {
    /// How far upper arm and forearm lie beside the line between the joints, along the axis at their end (mm); 0 where unknown.
    aside_mm: [f64; 2],
    /// Distance of the flange from the wrist (mm).
    wrist_mm: f64,
}

impl OwnBodies {
    pub(super) fn of(setup: &MeasurementSetup<'_>, still: &Chain<f64>) -> Self {
        let aside = |link: usize| {
            let centre = setup.nominal.bodies.as_ref().map(|bodies| bodies[link].centre_mm[2]);
            centre.filter(|_| is_parallel(still, link)).unwrap_or(0.0)
        };
        let flange = (still.last() * setup.nominal.flange).translation.vector;
        let wrist_mm = (flange - Vector3::from(still.origin[WRIST])).norm();
        Self { aside_mm: [aside(UPPER_ARM), aside(FOREARM)], wrist_mm }
    }

    /// Where the bodies are: column, upper arm, forearm.
    pub(super) fn lines(&self, frames: &Chain<f64>) -> Lines {
        let at = |k: usize| Vector3::from(frames.origin[k]);
        let axis = Vector3::from(frames.z[0]);
        let top = at(0) + axis * axis.dot(&(at(1) - at(0)));
        let beside = |link: usize, aside: f64| {
            let shift = Vector3::from(frames.z[link + 1]) * aside;
            [at(link) + shift, at(link + 1) + shift]
        };
        // The forearm reaches to the wrist: over an elbow that stands out, or over the one link between parallel axes.
        let parallel = is_parallel(frames, FOREARM);
        let second = if parallel { beside(FOREARM, self.aside_mm[1]) } else { [at(FOREARM + 1), at(WRIST)] };
        [
            [[at(0), top], [top, at(1)]],
            [beside(UPPER_ARM, 0.0), beside(UPPER_ARM, self.aside_mm[0])],
            [beside(FOREARM, 0.0), second],
        ]
    }

    /// Distance that the line from end `segment` on keeps from a body; `None` for neighbours and what they carry.
    pub(super) fn room_mm(&self, body: usize, segment: usize, radius_mm: f64) -> Option<f64> {
        match body {
            0 if segment >= FOREARM => Some(1.5 * radius_mm),
            1 if segment >= WRIST => Some(radius_mm),
            2 if segment > LAST_JOINT => Some(radius_mm.min(BENT * self.wrist_mm)),
            _ => None,
        }
    }
}

/// Whether the axes at both ends of a link are parallel.
fn is_parallel(frames: &Chain<f64>, link: usize) -> bool {
    Vector3::from(frames.z[link]).cross(&Vector3::from(frames.z[link + 1])).norm() < PARALLEL
}

/// Links, by their joint: their segments begin at the origin with the same number.
const UPPER_ARM: usize = 1;
const FOREARM: usize = 2;

/// The origin at which the wrist begins.
const WRIST: usize = 4;

/// The origin before the last link.
const LAST_JOINT: usize = 5;
