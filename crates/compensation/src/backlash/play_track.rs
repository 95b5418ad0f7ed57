//! State of each joint with backlash, followed along the segments of a program.

use crate::backlash::motion_end::{JointSides, ReachedEnd, SampledJoints};
use crate::backlash::reversals::{DEAD_BAND_RAD, turning_point};
use truegrind_arm::model::Joints;

/// A link that would have to move by less rests (rad): 0.003 mm on the largest arms.
const STILL_RAD: f64 = 1e-6;

/// Backlash state of one joint.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlayTrack {
    /// Flank on which the link lies; 0 if unknown or on neither.
    pub(crate) side: i8,
    /// Reversal point of the motor (rad).
    pub(crate) farthest: f64,
    /// Share of the current motion at which that was.
    pub(crate) since: f64,
    /// Interval that contains the link (rad).
    pub(crate) low: f64,
    pub(crate) high: f64,
    /// Half of its backlash (rad).
    pub(crate) half: f64,
}

impl PlayTrack {
    /// A link of unknown position within the backlash around its motor.
    pub(crate) fn unknown(motor: f64, half: f64) -> Self {
        Self { side: 0, farthest: motor, since: 0.0, low: motor - half, high: motor + half, half }
    }

    /// The flanks move the link along.
    fn take(&mut self, motor: f64) {
        let (low, high) = (motor - self.half, motor + self.half);
        (self.low, self.high) = (self.low.clamp(low, high), self.high.clamp(low, high));
    }

    /// Flank on which the link certainly lies for this motor position.
    fn flank(&self, motor: f64) -> i8 {
        let near = DEAD_BAND_RAD.min(0.1 * self.half);
        if self.high - (motor - self.half) <= near {
            -1
        } else if motor + self.half - self.low <= near {
            1
        } else {
            0
        }
    }

    /// Moves the motor; returns the share at which the side changed, if it did.
    fn go(&mut self, motor: f64, share: f64) -> Option<f64> {
        self.take(motor);
        if self.side == 0 {
            self.side = self.flank(motor);
            (self.farthest, self.since) = (motor, share);
            return (self.side != 0).then_some(share);
        }
        let gone = motor - self.farthest;
        // A joint that moves up arrives from below.
        let side = if gone > 0.0 { -1 } else { 1 };
        if self.side == side {
            (self.farthest, self.since) = (motor, share);
        } else if gone.abs() > DEAD_BAND_RAD {
            let turned = self.since;
            (self.side, self.farthest, self.since) = (side, motor, share);
            return Some(turned);
        }
        None
    }

    /// The motor stops as commanded; returns whether the side changed.
    fn rest(&mut self, motor: f64) -> bool {
        let before = self.side;
        (self.side, self.farthest) = (self.flank(motor), motor);
        self.side != before
    }

    /// The motor moves the link to its required position; returns whether the side differs from that along the segment.
    fn arrive(&mut self, motor: f64, link: f64) -> bool {
        let before = self.side;
        let (low, high) = (self.low - STILL_RAD, self.high + STILL_RAD);
        self.side = if link > high {
            -1
        } else if link < low {
            1
        } else if self.high - self.low <= STILL_RAD {
            self.side
        } else {
            0
        };
        self.take(link - f64::from(self.side) * self.half);
        self.farthest = motor;
        self.side != before
    }

    /// Marks the side as unknown.
    pub(crate) fn forget(&mut self, link: Option<f64>, motor: f64) {
        let middle = link.unwrap_or(motor);
        *self = Self { farthest: motor, ..Self::unknown(middle, self.half) };
    }
}

/// From each share on, the side from which each joint arrives.
pub(crate) type SideChanges = Vec<(f64, JointSides)>;

/// The sides on which all paths agree.
pub(crate) fn agreed(mut sides: impl Iterator<Item = JointSides>) -> JointSides {
    let first = sides.next().unwrap_or([0; 6]);
    sides.fold(first, |all, one| std::array::from_fn(|j| if all[j] == one[j] { all[j] } else { 0 }))
}

/// Moves all joints to the end of a motion along every possible path. `paths`: the start and the samples between, along the
/// path and, where possible, with separate wrist interpolation.
pub(crate) fn arrive(
    start: [PlayTrack; 6],
    reached: &ReachedEnd<'_>,
    paths: &[SampledJoints],
) -> (SideChanges, [PlayTrack; 6]) {
    let (path, straight) = reached.path_kinds();
    let samples = paths[0].as_slice();
    let path = path && samples.len() > 1;
    let mut found: Option<(SideChanges, [PlayTrack; 6])> = None;
    let mut add = |turns: SideChanges, end: [PlayTrack; 6]| match &mut found {
        None => found = Some((turns, end)),
        Some((_, first)) => {
            for (j, (one, other)) in first.iter_mut().zip(&end).enumerate() {
                if one.side != other.side {
                    one.forget(reached.links.map(|links| links[j]), reached.joints[j]);
                }
                (one.low, one.high) = (one.low.min(other.low), one.high.max(other.high));
            }
        }
    };
    let mut once = |samples: &[(f64, Joints)]| {
        let mut tracks = start;
        let turns = follow(&mut tracks, samples, reached);
        add(turns, tracks);
    };
    if path {
        paths.iter().for_each(|samples| once(samples));
    }
    if straight || !path {
        once(&samples[..samples.len().min(1)]);
    }
    let (turns, mut end) = found.unwrap_or((Vec::new(), start));
    // Inserted targets make the link follow the intended motion: it can reverse near the end by less than
    // its backlash.
    if path
        && reached.may_insert
        && let Some(links) = reached.links
    {
        for (joint, (track, begin)) in end.iter_mut().zip(&start).enumerate() {
            let side = side_of_link(begin, samples, joint, reached.joints[joint], links[joint]);
            if side.is_some_and(|side| side != track.side) {
                track.forget(Some(links[joint]), reached.joints[joint]);
            }
        }
    }
    (turns, end)
}

/// Flank of each link where the circle point is passed: none while a joint that reversed before it takes up its backlash.
pub(crate) fn passing(
    mut tracks: [PlayTrack; 6],
    reached: &ReachedEnd<'_>,
    samples: &[(f64, Joints)],
    passes: f64,
) -> JointSides {
    if reached.via.is_none() {
        return [0; 6];
    }
    let mut sides = [0; 6];
    for (joint, track) in tracks.iter_mut().enumerate() {
        let inner = samples.iter().map(|(share, joints)| (*share, joints[joint]));
        let angles: Vec<(f64, f64)> = inner.chain([(1.0, reached.joints[joint])]).collect();
        let after = angles.iter().position(|(share, _)| *share >= passes).unwrap_or(angles.len() - 1);
        for k in 0..after {
            for (share, angle) in turning_point(&angles, k).into_iter().chain([angles[k]]) {
                track.go(angle, share);
            }
        }
        let Some(before) = after.checked_sub(1).map(|k| angles[k]) else {
            sides[joint] = track.flank(angles[after].1);
            continue;
        };
        if let Some((share, angle)) = turning_point(&angles, after).filter(|(share, _)| *share <= passes) {
            track.go(angle, share);
        }
        let (from, to) = (before, angles[after]);
        let motor = from.1 + (to.1 - from.1) * (passes - from.0) / (to.0 - from.0).max(f64::EPSILON);
        track.take(motor);
        sides[joint] = track.flank(motor);
    }
    sides
}

/// Side from which a link arrives that follows the intended motion; `None` where it does not reverse on the way.
fn side_of_link(
    begin: &PlayTrack,
    samples: &[(f64, Joints)],
    joint: usize,
    motor: f64,
    link: f64,
) -> Option<i8> {
    if begin.half == 0.0 || samples.is_empty() {
        return None;
    }
    let behind = [0.5 * (begin.low + begin.high) - samples[0].1[joint], link - motor];
    let links: Vec<(f64, f64)> = samples
        .iter()
        .map(|(s, q)| (*s, q[joint] + behind[0] * (1.0 - s) + behind[1] * s))
        .chain([(1.0, link)])
        .collect();
    let mut track =
        PlayTrack { half: 0.0, low: links[0].1, high: links[0].1, farthest: links[0].1, ..*begin };
    track.side = 0;
    let mut turned = false;
    for k in 1..links.len() {
        for (share, angle) in turning_point(&links, k).into_iter().chain([links[k]]) {
            let gone = angle - track.farthest;
            let side = if gone > 0.0 { -1 } else { 1 };
            if track.side == side {
                track.farthest = angle;
            } else if gone.abs() > STILL_RAD {
                turned |= track.side != 0;
                (track.side, track.farthest, track.since) = (side, angle, share);
            }
        }
    }
    turned.then_some(track.side)
}

/// Moves all joints along a path to its end; returns where sides changed.
fn follow(tracks: &mut [PlayTrack; 6], samples: &[(f64, Joints)], reached: &ReachedEnd<'_>) -> SideChanges {
    let mut sides = tracks.map(|t| t.side);
    let mut turned: Vec<(f64, usize, i8)> = Vec::new();
    for (joint, track) in tracks.iter_mut().enumerate() {
        let end = reached.joints[joint];
        let angles: Vec<(f64, f64)> =
            samples.iter().map(|(share, joints)| (*share, joints[joint])).chain([(1.0, end)]).collect();
        let mut go = |track: &mut PlayTrack, share: f64, angle: f64| {
            if let Some(at) = track.go(angle, share) {
                turned.push((at, joint, track.side));
            }
        };
        for (k, &(share, angle)) in angles.iter().enumerate() {
            if k > 0
                && let Some((share, angle)) = turning_point(&angles, k)
            {
                go(track, share, angle);
            }
            if k + 1 < angles.len() {
                go(track, share, angle);
            }
        }
        let since = track.since;
        let other = match reached.links {
            Some(links) => track.arrive(end, links[joint]),
            None => {
                go(track, 1.0, end);
                track.rest(end)
            }
        };
        if other {
            turned.push((since, joint, track.side));
        }
    }
    turned.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut turns = vec![(0.0, sides)];
    for (share, joint, side) in turned {
        sides[joint] = side;
        match turns.last_mut() {
            Some(last) if share - last.0 < 1e-6 => last.1 = sides,
            _ => turns.push((share, sides)),
        }
    }
    turns
}
