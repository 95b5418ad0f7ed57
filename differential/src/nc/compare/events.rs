//! Two runs, event by event.

use nalgebra::Point3;

use super::Pair;
use super::follow::{Follower, off, plane_of};
use crate::arm::{Pose, difference};
use crate::nc::arc::axes;
use crate::nc::machine::{Event, Mode, Move, Say};
use crate::outcome::{Dialect, Disagreement, Tally};
use crate::stated::Stated;
use crate::under_test::{Row, Status};

/// How far a place may be from where it is written to be: four decimals of a millimetre, five of a degree and of an inch
/// on a tool of 0.3 m, and the remainder of the solution.
const WRITTEN_MM: f64 = 0.004;
/// The same for the turn of the tool (rad).
const WRITTEN_RAD: f64 = 1e-5;
/// Between samples the distance of a path is known to this (mm).
const CHORD_MM: f64 = 0.02;
/// What is left goes where it went, but for the rounding of words that are said again (mm, °).
const LEFT_MM: f64 = 2e-3;
const LEFT_DEG: f64 = 1e-3;

/// Compares the runs; the second may have motions that were put in.
pub fn compare(pair: &Pair<'_>, before: &[Event], after: &[Event], whole: bool) -> Tally {
    let mut judge = Judge {
        pair,
        tally: Tally::default(),
        arm: Follower::new(pair.case, pair.seed),
        arm_before: Follower::new(pair.case, pair.seed),
        most: 0.0,
        open_before: 0.0,
        before_cycle: false,
    };
    let mut old = before.iter();
    for new in after {
        let put_in = !matches!(new, Event::Note(_)) && pair.origin(new).is_none();
        if put_in {
            if let Event::Move(done) = new {
                judge.arm.go(done);
            }
            continue;
        }
        let Some(this) = old.next() else {
            if whole {
                judge.wrong(0, "more-events", format!("{new:?}"));
            }
            return judge.tally;
        };
        let mut ahead = old.clone().filter(|event| !matches!(event, Event::Note(_)));
        judge.before_cycle = match (ahead.next(), ahead.next()) {
            (Some(Event::Elsewhere(_, text, _)), _) => text.contains("G81") || text.contains("M99"),
            // The block that calls a cycle of Heidenhain may move to its place first.
            (Some(Event::Move(done)), Some(Event::Elsewhere(line, text, _))) => {
                done.line == *line && text.contains("M99")
            }
            _ => false,
        };
        judge.event(this, new);
        if !judge.tally.disagreements.is_empty() {
            return judge.tally;
        }
    }
    if let Some(old) = old.next() {
        judge.wrong(0, "fewer-events", format!("{old:?}"));
    }
    judge.tally
}

struct Judge<'j> {
    pair: &'j Pair<'j>,
    tally: Tally,
    arm: Follower<'j>,
    arm_before: Follower<'j>,
    /// The largest correction so far (mm).
    most: f64,
    /// What is stated of the end of the motion before (mm).
    open_before: f64,
    /// Whether the motion leads to a canned cycle.
    before_cycle: bool,
}

impl Judge<'_> {
    fn wrong(&mut self, line: usize, kind: &'static str, text: String) {
        let Pair { dialect, seed, .. } = *self.pair;
        self.tally.disagreements.push(Disagreement { dialect, seed, line, kind, text });
    }

    fn event(&mut self, old: &Event, new: &Event) {
        match (old, new) {
            (Event::Move(old), Event::Move(new)) => {
                if self.pair.origins.get(new.line).copied().flatten() != Some(old.line) {
                    return self.wrong(old.line + 1, "order", format!("line {} instead", new.line + 1));
                }
                self.tally.executed += 1;
                self.motion(old, new);
            }
            (Event::Note(a), Event::Note(b)) if a == b => {}
            (Event::Elsewhere(line, a, begin), Event::Elsewhere(_, b, begin_now)) => {
                self.arm.lost();
                self.arm_before.lost();
                if a != b {
                    return self.wrong(line + 1, "path", format!("{a} -> {b}"));
                }
                if let (Some((at, chain)), Some((now, chain_now))) = (begin, begin_now) {
                    // A cycle, a probe or a call begins where the tool stands; a curve is another where its start is.
                    let curve = ["CIP", "CT", "G5", "POLY"].iter().any(|word| a.contains(word));
                    let bound = if curve { LEFT_MM } else { 3.0 * self.most + 0.05 };
                    if let Some(off) = apart(*chain, *at, *chain_now, *now, [true; 3], bound) {
                        self.wrong(line + 1, "path-begins-elsewhere", format!("{a}: {off}"));
                    }
                }
            }
            _ => self.wrong(0, "events", format!("{old:?} -> {new:?}")),
        }
    }

    fn rows(&self, line: usize) -> Vec<&Row> {
        self.pair.done.rows.iter().filter(|row| row.line == line + 1).collect()
    }

    fn motion(&mut self, old: &Move, new: &Move) {
        let line = old.line + 1;
        if (old.mode, &old.state) != (new.mode, &new.state) {
            let text = format!("{:?} {} -> {:?} {}", old.mode, old.state, new.mode, new.state);
            return self.wrong(line, "state", text);
        }
        let rows: Vec<Row> = self.rows(old.line).into_iter().cloned().collect();
        self.arm_before.go(old);
        let real = self.arm.go(new);
        let told = old.pose().zip(new.pose()).zip(old.tool);
        // Numbers that are said to be right as they stand are as good as changed: behind a G92 at a corrected place they mean
        // another place than before.
        let corrected = |row: &&Row| match row.status {
            Status::Changed | Status::Flagged => true,
            Status::Left | Status::Refused => row.right && told.is_some(),
        };
        let changed = rows.iter().find(corrected);
        let Some(row) = changed else {
            if rows.iter().any(|row| row.status == Status::Refused) {
                self.tally.refused += 1;
            } else {
                self.tally.left += 1;
            }
            let reason = rows.iter().find_map(|row| row.reason.clone()).unwrap_or_default();
            return self.left(old, new, &reason);
        };
        let Some(((wanted, given), tool)) = told else {
            let text = format!(
                "changed, but where it goes is not told: {:?} {:?} {}",
                old.to, old.angles, old.state
            );
            return self.wrong(line, "unknown-changed", text);
        };
        if old.tool.map(|t| t.translation) != new.tool.map(|t| t.translation) {
            return self.wrong(line, "tool", format!("{:?} {:?}", old.tool, new.tool));
        }
        let Some(real) = real else {
            self.tally.unreachable += 1;
            return;
        };
        self.tally.corrected += 1;
        self.most = self.most.max(difference(&wanted, &given).0);
        // TX TY TZ tell the axis of the tool and no turn about it.
        let axis_alone = self.pair.dialect == Dialect::Heidenhain && old.angles == [None; 3];
        let (mm, rad) = off(&real, &wanted, axis_alone);
        let stated = Stated::of(Some(row), &self.pair.case.arm, false);
        let written = |mm: f64, rad: f64| mm <= WRITTEN_MM && rad <= WRITTEN_RAD;
        let right = |mm: f64, rad: f64| mm <= WRITTEN_MM + stated.mm && rad <= WRITTEN_RAD + stated.rad;
        if !written(mm, rad) && right(mm, rad) {
            self.tally.stated += 1;
        }
        if !right(mm, rad) {
            let ways = self.arm.every_way(&wanted, &given, &tool, axis_alone);
            if ways.iter().any(|&(mm, rad)| right(mm, rad)) {
                self.tally.corrected -= 1;
                self.tally.open += 1;
                // What begins here begins that far off.
                self.open_before = mm;
                return;
            }
            let before = self.arm.at(&wanted, &tool).map_or(0.0, |pose| difference(&pose, &wanted).0);
            let text = format!(
                "{mm:.4} mm and {rad:.6} rad from where it shall be (before {before:.3} mm; stated {:.4} mm, {:.6} rad; {:?} \
                 {:?}, links {} for {}): {:?} -> {:?}, {:?} -> {:?}",
                stated.mm,
                stated.rad,
                row.after_mm,
                row.sigma_mm,
                self.arm.flanks(),
                self.arm.meant_flanks(&wanted, &tool),
                old.to,
                new.to,
                old.angles,
                new.angles
            );
            let kind = if self.pair.case.play { "wrong-place-with-play" } else { "wrong-place" };
            return self.wrong(line, kind, text);
        }
        self.changed_arc(old, new, row);
        self.open_before = stated.mm;
    }

    /// An arc that was changed keeps to the way that was meant.
    fn changed_arc(&mut self, old: &Move, new: &Move, row: &Row) {
        let (Some(was), line) = (old.arc, old.line + 1) else { return };
        let Some(now) = new.arc else {
            return self.wrong(line, "arc-lost", format!("{was:?} {:?} {:?}", new.from, new.to));
        };
        let mismatch = (now.radii[0] - now.radii[1]).abs() - (was.radii[0] - was.radii[1]).abs();
        if mismatch > 3e-3 {
            return self.wrong(line, "arc-radii", format!("{was:?} -> {now:?}"));
        }
        // As long as a short arc, and another one near it, may differ; a circle is none the other way round.
        if was.sweep.signum() != now.sweep.signum() || (was.sweep - now.sweep).abs() > 1.5 {
            return self.wrong(line, "arc-sweep", format!("{was:?} -> {now:?}"));
        }
        let off = |arm: &Follower<'_>| arm.beside(old).map(|off| off.iter().copied().fold(0.0, f64::max));
        let (Some(real), Some(raw)) = (off(&self.arm), off(&self.arm_before)) else { return };
        // What the report states of the path and of its ends; where it says that it does not check it, no worse than the
        // program was.
        let ends = self.open_before.max(Stated::of(Some(row), &self.pair.case.arm, false).mm);
        let allowed = match row.bend_mm {
            Some(bend) => bend + ends + CHORD_MM,
            None => raw + self.most + CHORD_MM,
        };
        if real > allowed {
            let text = format!(
                "the path is {real:.3} mm beside what was meant, before {raw:.3}, stated {:?} ({:?} {:?}): {was:?} -> {now:?}",
                row.bend_mm, row.status, row.reason
            );
            let kind = if self.pair.case.play { "arc-path-with-play" } else { "arc-path" };
            self.wrong(line, kind, text);
        }
    }

    /// A motion that is left goes where it always went, also in the axes that it does not say. Only moves to a place of the machine, and rapid
    /// ones to a cycle, go on there from where the motion before ended: nothing is cut by them.
    fn left(&mut self, old: &Move, new: &Move, reason: &str) {
        let line = old.line + 1;
        let stated = old.words.place.map(|say| matches!(say, Some(Say::To(_))));
        let of_machine = reason.contains("machine coordinates") || reason.contains("reference point");
        let of_cycle = self.before_cycle && old.mode == Mode::Rapid;
        let asked = if of_machine || of_cycle { stated } else { [true; 3] };
        if let Some(off) = apart(old.origin, old.to, new.origin, new.to, asked, LEFT_MM) {
            return self.wrong(line, "left-moved", format!("{off} ({reason})"));
        }
        for (axis, say) in old.words.turn.iter().enumerate() {
            let (Some(a), Some(b)) = (old.angles[axis], new.angles[axis]) else { continue };
            let off = (a - b).abs();
            if off > LEFT_DEG && matches!(say, Some(Say::To(_))) {
                return self.wrong(
                    line,
                    "left-turned",
                    format!("{:?} -> {:?} ({reason})", old.angles, new.angles),
                );
            }
            if off > 3.0 {
                return self.wrong(line, "left-turned-far", format!("{:?} -> {:?}", old.angles, new.angles));
            }
        }
        let bound = 3.0 * self.most + 0.05;
        if let Some(off) = apart(old.origin, old.to, new.origin, new.to, [true; 3], bound) {
            return self.wrong(line, "left-moved-far", format!("{off} ({reason})"));
        }
        if let (Some(was), Some(now)) = (old.arc, new.arc) {
            let (a, b, _) = axes(plane_of(&old.state));
            let within = std::array::from_fn(|axis| axis == a || axis == b);
            let moved = apart(old.origin, was.mid, new.origin, now.mid, within, 5e-3);
            // What counts from its start, and what the control takes for no circle, goes on from where it starts.
            let whole = stated[a] && stated[b] && (was.radii[0] - was.radii[1]).abs() < 0.02;
            if let Some(off) = moved.filter(|_| whole) {
                self.wrong(line, "left-arc-moved", format!("half way {off}: {was:?} -> {now:?} ({reason})"));
            } else if whole && (was.sweep - now.sweep).abs() > 1.0 {
                self.wrong(line, "left-arc-sweep", format!("{was:?} -> {now:?} ({reason})"));
            }
        } else if old.arc.is_some() != new.arc.is_some() {
            self.wrong(line, "left-arc-known", format!("{:?} -> {:?} ({reason})", old.arc, new.arc));
        }
    }
}

/// How far two places are apart, in the coordinates of the first, if more than `bound` in one of the axes asked for.
fn apart(
    chain: Option<Pose>,
    at: [Option<f64>; 3],
    chain_now: Option<Pose>,
    now: [Option<f64>; 3],
    asked: [bool; 3],
    bound: f64,
) -> Option<String> {
    let mut there = now;
    if let (Some(chain), Some(chain_now), [Some(x), Some(y), Some(z)]) = (chain, chain_now, now) {
        let moved = chain.inverse() * chain_now * Point3::new(x, y, z);
        there = [Some(moved.x), Some(moved.y), Some(moved.z)];
    }
    let far = |axis: usize| match (at[axis], there[axis]) {
        (Some(a), Some(b)) => asked[axis] && (a - b).abs() > bound,
        _ => false,
    };
    (0..3).any(far).then(|| format!("{at:?} -> {there:?}"))
}
