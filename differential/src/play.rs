//! Joints with play as gears have it: a link stays where it is until one of its flanks takes it along.

use crate::arm::{Arm, Circumstance, Pose, difference};
use crate::joint_map::JointMap;

/// A joint that comes to rest on a flank again to within this has not left it (rad).
const TOUCHING: f64 = 1e-12;

/// Where the links of an arm are while its motors move.
#[derive(Debug, Clone)]
pub struct Links {
    /// What turns the gears, of the angles that the controller counts.
    map: JointMap,
    /// Half of the play of each joint (rad).
    half: [f64; 6],
    /// The angles of the links; none where nothing is known of the way on which the motors came.
    at: Option<[f64; 6]>,
    /// Where in its play each link lies after such a way, from −1 to 1.
    rest: [f64; 6],
}

impl Links {
    /// Links of which nothing is known yet.
    pub fn new(arm: &Arm, rest: [f64; 6]) -> Self {
        Self { map: arm.map, half: arm.play.map(|play| 0.5 * play), at: None, rest }
    }

    /// Whether any joint has play.
    pub fn have_play(&self) -> bool {
        self.half.iter().any(|half| *half != 0.0)
    }

    /// The motors go a way of which nothing is known: the links come to lie anywhere.
    pub fn lose(&mut self) {
        self.at = None;
        // Elsewhere than last time.
        self.rest.rotate_left(1);
        self.rest[0] = -self.rest[0];
    }

    /// The motors go on, each in one direction, to where the controller counts `joints`.
    pub fn go(&mut self, joints: &[f64; 6]) {
        let motor = self.map.axes(joints);
        let (half, rest) = (self.half, self.rest);
        let before = self.at.unwrap_or_else(|| std::array::from_fn(|j| motor[j] + rest[j] * half[j]));
        self.at = Some(std::array::from_fn(|j| before[j].clamp(motor[j] - half[j], motor[j] + half[j])));
    }

    /// How far the links are before their motors (rad), which stand where the controller counts `joints`; nothing has been lost since.
    pub fn behind(&self, joints: &[f64; 6]) -> [f64; 6] {
        let motor = self.map.axes(joints);
        match self.at {
            Some(at) if self.have_play() => std::array::from_fn(|j| at[j] - motor[j]),
            _ => [0.0; 6],
        }
    }

    /// The flank on which each link lies: −1 where its motor pushed it from below, 1 from above, 0 for neither, in words.
    pub fn flanks(&self, joints: &[f64; 6]) -> String {
        let behind = self.behind(joints);
        (0..6)
            .map(|j| match (self.half[j], behind[j]) {
                (0.0, _) => '.',
                (half, by) if by <= -half + TOUCHING => '-',
                (half, by) if by >= half - TOUCHING => '+',
                _ => '0',
            })
            .collect()
    }
}

/// Each way in which links can lie on their flanks or in the middle, in words, with how far off (mm, rad) the flange is then.
fn every_flank<'a>(
    arm: &'a Arm,
    q: &'a [f64; 6],
    at: &'a Circumstance,
    off: &'a dyn Fn(&Pose) -> (f64, f64),
) -> impl Iterator<Item = (String, (f64, f64))> + 'a {
    let sides = |code: usize| std::array::from_fn(|j| (code / 3usize.pow(j as u32) % 3) as i32 - 1);
    let all =
        (0..729).map(sides).filter(|sides: &[i32; 6]| (0..6).all(|j| sides[j] == 0 || arm.play[j] != 0.0));
    all.map(move |sides| {
        let behind = std::array::from_fn(|j| 0.5 * arm.play[j] * f64::from(sides[j]));
        let reached = arm.actual_forward(q, &Circumstance { behind, ..*at });
        let word = |j: usize| match (arm.play[j] == 0.0, sides[j]) {
            (true, _) => '.',
            (_, -1) => '-',
            (_, 1) => '+',
            _ => '0',
        };
        ((0..6).map(word).collect(), off(&reached))
    })
}

/// How far a turn counts beside a place (mm per rad).
const LEVER_MM: f64 = 1000.0;

fn best(
    arm: &Arm,
    q: &[f64; 6],
    at: &Circumstance,
    off: &dyn Fn(&Pose) -> (f64, f64),
) -> (String, (f64, f64)) {
    let size = |off: (f64, f64)| off.0 + LEVER_MM * off.1;
    every_flank(arm, q, at, off)
        .min_by(|a, b| size(a.1).total_cmp(&size(b.1)))
        .unwrap_or((String::new(), (f64::INFINITY, f64::INFINITY)))
}

/// The flanks on which links would have to lie for the flange to stand where it shall, the nearest of all, in words: what
/// a correction was worked out for.
pub fn meant_flanks(arm: &Arm, q: &[f64; 6], at: &Circumstance, flange: &Pose) -> String {
    best(arm, q, at, &|reached| difference(reached, flange)).0
}

/// How far off (mm, rad), as `off` tells it of a flange, the arm is with the links as suits it best.
pub fn meant_links(
    arm: &Arm,
    q: &[f64; 6],
    at: &Circumstance,
    off: &dyn Fn(&Pose) -> (f64, f64),
) -> (f64, f64) {
    best(arm, q, at, off).1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_waits_until_the_play_is_taken_up() {
        let mut arm = crate::model::with(1, false, false).arm;
        arm.play = [0.2, 0.0, 0.0, 0.0, 0.0, 0.0];
        let mut links = Links::new(&arm, [0.0; 6]);
        let mut at = |angle: f64| {
            let motor = [angle, 0.0, 0.0, 0.0, 0.0, 0.0];
            links.go(&motor);
            (((links.behind(&motor)[0] + angle) * 1e9).round() / 1e9, links.flanks(&motor))
        };
        assert_eq!(at(0.0), (0.0, "0.....".to_owned()));
        assert_eq!(at(1.0), (0.9, "-.....".to_owned()));
        assert_eq!(at(0.95), (0.9, "0.....".to_owned()));
        assert_eq!(at(0.8), (0.9, "+.....".to_owned()));
        assert_eq!(at(0.5), (0.6, "+.....".to_owned()));
    }
}
