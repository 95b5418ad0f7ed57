//! Where an arm is measured, in which order, and when.

use nalgebra::{Matrix6, UnitQuaternion, Vector3, Vector6};
use rand::{Rng, RngExt};

use crate::arms::{Angles, Pose, Sheet, Strain};
use crate::draw::{between, direction, one, scaled};

/// How the poses were chosen.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Design {
    /// Random poses in random order.
    Random,
    /// Few angles of each joint, all combinations, to and fro.
    Grid,
    /// Random poses, each read several times before the arm goes on.
    Repeats,
    /// 500 points of a smooth closed curve, in order.
    Curve,
    /// 2,500 points of a curved surface, line by line.
    Raster,
}

impl Design {
    /// All of them.
    pub const ALL: [Design; 5] =
        [Design::Random, Design::Grid, Design::Repeats, Design::Curve, Design::Raster];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Design::Random => "random",
            Design::Grid => "grid",
            Design::Repeats => "repeats",
            Design::Curve => "curve",
            Design::Raster => "raster",
        }
    }

    /// Whether rows are points of a path that the arm runs through.
    pub fn is_path(self) -> bool {
        matches!(self, Design::Curve | Design::Raster)
    }
}

/// One visit of a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Visit {
    /// Logged angles (rad).
    pub q: Angles,
    /// The angles from which the arm came to this pose.
    pub before: Angles,
    /// How often the pose was read before, since the arm came.
    pub repeat: usize,
    /// Time since the arm was switched on (h).
    pub hours: f64,
    /// Nearest measured row.
    pub row: usize,
    /// Whether it is judged. Fresh visits stand among others that only lead to them and away.
    pub counted: bool,
}

/// Visits in order, and the idle time among them.
#[derive(Debug, Clone, PartialEq)]
pub struct Walk {
    /// How the poses were chosen.
    pub design: Design,
    /// The visits.
    pub visits: Vec<Visit>,
    /// From when to when the arm stood still (h).
    pub pause: Option<[f64; 2]>,
    /// How often each pose is read before the arm goes on.
    pub repeats: usize,
}

/// The least and greatest number of rows of designs that are not paths.
const ROWS: (f64, f64) = (200.0, 1000.0);

impl Walk {
    /// Draws a walk; `most` rows at most.
    pub fn draw(sheet: &Sheet, design: Design, most: usize, rng: &mut impl Rng) -> Self {
        let rows = (scaled(rng, ROWS.0, ROWS.1) as usize).min(most);
        let (poses, repeats) = match design {
            Design::Random => (random(sheet, rows, rng), 1),
            Design::Repeats => {
                let each = rng.random_range(3..6);
                (random(sheet, rows.div_ceil(each), rng), each)
            }
            Design::Grid => (grid(sheet, rows.max(216.min(most)), rng), 1),
            Design::Curve => (path(sheet, &curve(rng), 500.min(most), rng), 1),
            Design::Raster => (path(sheet, &raster(rng), 2500.min(most), rng), 1),
        };
        let poses: Vec<Angles> = poses.into_iter().flat_map(|q| std::iter::repeat_n(q, repeats)).collect();
        let n = poses.len();
        let step_h = match design {
            Design::Curve => scaled(rng, 0.4, 6.0) / 3600.0,
            Design::Raster => scaled(rng, 0.4, 3.0) / 3600.0,
            _ => scaled(rng, 8.0, 40.0) / 3600.0,
        };
        let pause_at = (!design.is_path() && rng.random_range(0..3) == 0)
            .then(|| (rng.random_range(n / 4..3 * n / 4), between(rng, 0.15, 0.5) * step_h * n as f64));
        let (mut hours, mut pause, mut visits) = (0.0, None, Vec::with_capacity(n));
        let phase = between(rng, 0.0, 6.0);
        for (i, q) in poses.iter().enumerate() {
            if let Some((at, length)) = pause_at
                && at == i
            {
                pause = Some([hours, hours + length]);
                hours += length;
            }
            // No arm takes the same time for every step, and no path is run at one speed.
            hours += step_h
                * if design.is_path() {
                    1.0 + 0.4 * (phase + 25.0 * i as f64 / n as f64).sin()
                } else {
                    between(rng, 0.7, 1.3)
                };
            let from = (i - i % repeats).saturating_sub(1);
            visits.push(Visit {
                q: *q,
                before: poses[from],
                repeat: i % repeats,
                hours,
                row: i,
                counted: true,
            });
        }
        Self { design, visits, pause, repeats }
    }

    /// Where the arm is at a time: between two rows it goes straight in its joints. On a curve it goes smoothly through them, since no speed
    /// jumps because a sensor is read there (cubic Hermite, slopes by central differences).
    pub fn joints_at(&self, hours: f64) -> Angles {
        let visits = &self.visits;
        let next = visits.partition_point(|v| v.hours < hours);
        let last = visits.len() - 1;
        if next == 0 || next > last {
            return visits[next.min(last)].q;
        }
        let (a, b) = (&visits[next - 1], &visits[next]);
        let share = (hours - a.hours) / (b.hours - a.hours);
        if self.design != Design::Curve {
            return std::array::from_fn(|j| a.q[j] + share * (b.q[j] - a.q[j]));
        }
        let slope = |k: usize, j: usize| {
            let (before, after) = (&visits[k.saturating_sub(1)], &visits[(k + 1).min(last)]);
            (after.q[j] - before.q[j]) / (after.hours - before.hours) * (b.hours - a.hours)
        };
        let (t, t2) = (share, share * share);
        let t3 = t2 * t;
        let [from, leaving, to, arriving] =
            [2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t, 3.0 * t2 - 2.0 * t3, t3 - t2];
        std::array::from_fn(|j| {
            from * a.q[j] + leaving * slope(next - 1, j) + to * b.q[j] + arriving * slope(next, j)
        })
    }

    /// Length of the measurement (h).
    pub fn length_h(&self) -> f64 {
        self.visits.last().map_or(0.0, |v| v.hours)
    }

    /// Fresh visits of the same measurement, `count` of them counted: at its times, on its path, beside its grid or in its room,
    /// each reached by a step as the rows were.
    pub fn fresh(&self, sheet: &Sheet, count: usize, rng: &mut impl Rng) -> Vec<Visit> {
        let n = self.visits.len();
        let mut places: Vec<f64> = (0..count.div_ceil(self.repeats))
            .map(|_| self.off_ends(between(rng, 1.0, (n - 2) as f64)))
            .collect();
        places.sort_by(f64::total_cmp);
        places.into_iter().flat_map(|place| self.beside(sheet, place, rng)).collect()
    }

    /// A place of a raster that is not beside the end of a line: a row stands there in every run of the path, and none beside it.
    fn off_ends(&self, place: f64) -> f64 {
        let is_beside = |low: usize| (low..=low + 1).any(|row| self.turns_at(row));
        let low = place.floor() as usize;
        if self.design != Design::Raster || !is_beside(low) {
            return place;
        }
        let last = self.visits.len() - 3;
        let other =
            (low..last).find(|low| !is_beside(*low)).or_else(|| (1..low).rev().find(|low| !is_beside(*low)));
        other.unwrap_or(low) as f64 + place.fract()
    }

    /// Whether the path turns sharply at a row.
    fn turns_at(&self, row: usize) -> bool {
        let (Some(before), Some(next)) = (row.checked_sub(1), self.visits.get(row + 1)) else { return false };
        let [before, at, next] =
            [&self.visits[before].q, &self.visits[row].q, &next.q].map(|q| Vector6::from(*q));
        let (came, goes) = (at - before, next - at);
        came.dot(&goes) < 0.8 * came.norm() * goes.norm()
    }

    /// One fresh place with what leads there and away. `place` counts rows.
    fn beside(&self, sheet: &Sheet, place: f64, rng: &mut impl Rng) -> Vec<Visit> {
        let (low, share) = (place.floor() as usize, place.fract());
        let (a, b) = (&self.visits[low], &self.visits[low + 1]);
        let idle = self.pause.is_some_and(|p| p[0] >= a.hours && p[1] <= b.hours);
        let hours = if idle { a.hours } else { a.hours + share * (b.hours - a.hours) };
        let step = if idle { 0.0 } else { b.hours - a.hours };
        let row = place.round() as usize;
        let visit = |q: Angles, before: Angles, hours: f64, counted: bool| Visit {
            q,
            before,
            repeat: 0,
            hours,
            row,
            counted,
        };
        match self.design {
            Design::Curve | Design::Raster => {
                let at = |k: f64| self.joints_at(hours + k * step);
                let three = [-1.0, 0.0, 1.0];
                three.map(|k| visit(at(k), at(k - 1.0), hours + k * step, k == 0.0)).to_vec()
            }
            Design::Grid => {
                // A step of the grid, moved sideways within the room.
                let aside: Angles = std::array::from_fn(|_| between(rng, -0.15, 0.15));
                let moved = |q: &Angles| std::array::from_fn(|j| q[j] + aside[j]);
                let (from, to) = (moved(&a.q), moved(&b.q));
                vec![visit(from, from, hours, false), visit(to, from, hours, true)]
            }
            Design::Random | Design::Repeats => {
                let [from, to] = [0, 1].map(|_| random(sheet, 1, rng)[0]);
                let mut out = vec![visit(from, from, hours, false), visit(to, from, hours, true)];
                let again = |repeat| Visit { repeat, ..visit(to, from, hours, true) };
                out.extend((1..self.repeats).map(again));
                out
            }
        }
    }
}

fn random(sheet: &Sheet, count: usize, rng: &mut impl Rng) -> Vec<Angles> {
    (0..count).map(|_| sheet.room_deg.map(|[low, high]| between(rng, low, high).to_radians())).collect()
}

/// Levels of the six joints, as near to `rows` in all as whole numbers allow.
fn grid(sheet: &Sheet, rows: usize, rng: &mut impl Rng) -> Vec<Angles> {
    let mut levels = [2_usize, 2, 2, 2, 2, 1];
    // The large joints first.
    for j in [0, 1, 2, 4, 3, 0, 1, 2, 5, 4].into_iter().cycle().take(40) {
        let mut more = levels;
        more[j] += 1;
        if more.iter().product::<usize>() <= rows {
            levels = more;
        }
    }
    let shift: Angles = std::array::from_fn(|_| between(rng, -0.04, 0.04));
    let level = |j: usize, k: usize| {
        let [low, high] = sheet.room_deg[j];
        let share = if levels[j] == 1 { 0.5 } else { 0.06 + 0.88 * k as f64 / (levels[j] - 1) as f64 };
        (low + (share + shift[j]) * (high - low)).to_radians()
    };
    let total: usize = levels.iter().product();
    (0..total)
        .map(|index| {
            let mut rest = index;
            let mut q = [0.0; 6];
            // The last joint runs fastest, to and fro.
            for j in (0..6).rev() {
                let (k, lap) = (rest % levels[j], rest / levels[j]);
                q[j] = level(j, if lap % 2 == 0 { k } else { levels[j] - 1 - k });
                rest = lap;
            }
            // A joint with one level would show nothing of itself.
            if levels[5] == 1 {
                q[5] += 0.7 * if index % 2 == 0 { 1.0 } else { -1.0 };
            }
            q
        })
        .collect()
}

/// A path: displacement in shares of the reach and tilt (rad) at a place from 0 to 1.
type Course = Box<dyn Fn(usize, usize) -> (Vector3<f64>, Vector3<f64>)>;

fn curve(rng: &mut impl Rng) -> Course {
    let order = [one(rng, &[1.0, 2.0]), one(rng, &[1.0, 2.0, 3.0]), one(rng, &[2.0, 3.0])];
    let phase: [f64; 6] = std::array::from_fn(|_| between(rng, 0.0, std::f64::consts::TAU));
    let size = Vector3::new(between(rng, 0.08, 0.2), between(rng, 0.15, 0.3), between(rng, 0.06, 0.16));
    let tilt = between(rng, 0.15, 0.5);
    Box::new(move |i, n| {
        let turn = std::f64::consts::TAU * i as f64 / n as f64;
        let wave = |k: usize, order: f64| (order * turn + phase[k]).sin();
        let at =
            Vector3::new(size.x * wave(0, order[0]), size.y * wave(1, order[1]), size.z * wave(2, order[2]));
        (at, Vector3::new(wave(3, 1.0), wave(4, 2.0), 0.5 * wave(5, 1.0)) * tilt)
    })
}

fn raster(rng: &mut impl Rng) -> Course {
    let size = [between(rng, 0.15, 0.3), between(rng, 0.25, 0.45)];
    let bow = [between(rng, -0.5, 0.5), between(rng, -0.5, 0.5)];
    let turn = between(rng, -0.4, 0.4);
    Box::new(move |i, n| {
        let lines = (n as f64).sqrt().round().max(1.0) as usize;
        let points = n.div_ceil(lines);
        let (line, point) = (i / points, i % points);
        let point = if line.is_multiple_of(2) { point } else { points - 1 - point };
        let share = |k: usize, of: usize| k as f64 / (of.max(2) - 1) as f64 - 0.5;
        let (x, y) = (size[0] * share(line, lines), size[1] * share(point, points));
        let (c, s) = (turn.cos(), turn.sin());
        // A bowl or a saddle, the tool on its normal.
        let z = bow[0] * x * x + bow[1] * y * y + 0.4 * x * y;
        let tilt = Vector3::new(2.0 * bow[1] * y + 0.4 * x, -2.0 * bow[0] * x - 0.4 * y, 0.0);
        (Vector3::new(c * x - s * y, s * x + c * y, z), tilt)
    })
}

/// Joint angles along a path, from a pose in the room; the path is made smaller until the arm reaches it.
fn path(sheet: &Sheet, course: &Course, count: usize, rng: &mut impl Rng) -> Vec<Angles> {
    let arm = sheet.nominal();
    let reach = sheet.reach_mm();
    let mut size = 1.0;
    loop {
        let mut start = sheet.middle();
        for (j, q) in start.iter_mut().enumerate() {
            let [low, high] = sheet.room_deg[j];
            *q += 0.15 * (high - low).to_radians() * between(rng, -1.0, 1.0);
        }
        // Away from the singular wrist, and from a stretched arm.
        start[4] = one(rng, &[-1.0, 1.0]) * between(rng, 0.7, 1.2);
        start[2] = stretched_away(sheet, start[2], rng);
        let home = arm.flange(&start, &Strain::default());
        let lean = direction(rng) * 0.2;
        let mut q = start;
        let mut out = Vec::with_capacity(count);
        for i in 0..count {
            let (shift, tilt) = course(i, count);
            let mut goal = home;
            goal.translation.vector += shift * (size * reach);
            goal.rotation = UnitQuaternion::from_scaled_axis((tilt + lean) * size) * goal.rotation;
            match reached(&arm, &goal, &q) {
                Some(found) if sheet.has_room(&found, 0.5) => q = found,
                _ => break,
            }
            out.push(q);
        }
        let leap = out
            .windows(2)
            .map(|w| (0..6).map(|j| (w[1][j] - w[0][j]).abs()).fold(0.0, f64::max))
            .fold(0.0, f64::max);
        if out.len() == count && leap < 0.5 {
            return out;
        }
        size *= 0.93;
    }
}

fn stretched_away(sheet: &Sheet, angle: f64, rng: &mut impl Rng) -> f64 {
    match sheet.name {
        "universal-robots-ur10" => one(rng, &[-1.0, 1.0]) * between(rng, 1.0, 1.7),
        "staubli-tx60" => between(rng, 0.9, 1.6),
        _ => angle,
    }
}

/// Joints that reach a pose, from nearby, by Newton's steps.
fn reached(arm: &crate::arms::Arm, goal: &Pose, near: &Angles) -> Option<Angles> {
    let still = Strain::default();
    let twist = |from: &Pose, to: &Pose| {
        let shift = to.translation.vector - from.translation.vector;
        let turn = (to.rotation * from.rotation.inverse()).scaled_axis() * 300.0;
        Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
    };
    let mut q = *near;
    for _ in 0..30 {
        let here = arm.flange(&q, &still);
        let off = twist(&here, goal);
        if off.norm() < 1e-7 {
            return Some(q);
        }
        let mut slope = Matrix6::zeros();
        for j in 0..6 {
            let mut moved = q;
            moved[j] += 1e-6;
            slope.set_column(j, &(twist(&here, &arm.flange(&moved, &still)) / 1e-6));
        }
        let step = slope.try_inverse()? * off;
        let shrink = (0.3 / step.amax()).min(1.0);
        (0..6).for_each(|j| q[j] += shrink * step[j]);
    }
    None
}
