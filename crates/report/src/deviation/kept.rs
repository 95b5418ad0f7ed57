//! Bit-exact JSON record of a path report, for shared runs.
//!
//! The numbers of each point are one space-separated string, since a path may have 100,000 points. Repeated poses of work object and
//! tool are stored once.

use nalgebra::{Quaternion, Translation3, UnitQuaternion, Vector3};
use serde_json::{Value, json};
use truegrind_arm::model::Joints;
use truegrind_arm::region::Outside;
use truegrind_compensation::deviation::{After, BetweenTargets, Deviation, PathPoint, PathReport};
use truegrind_math::se3::Pose;
use truegrind_programs::motion::MotionKind;

use crate::number::exact;

/// A missing value.
const NONE: &str = "-";
/// The pose of the previous point.
const SAME: &str = "=";

const KINDS: [(MotionKind, &str); 6] = [
    (MotionKind::Linear, "linear"),
    (MotionKind::Joint, "joint"),
    (MotionKind::Circular, "circular"),
    (MotionKind::AbsoluteJoint, "absolute-joint"),
    (MotionKind::External, "external"),
    (MotionKind::Unknown, "unknown"),
];

/// The record of a report.
pub fn kept(report: &PathReport) -> Value {
    let PathReport {
        program,
        files,
        model,
        after,
        points,
        missing,
        differences,
        between,
        held_out_mm,
        turn_sigma_rad,
        assumptions,
    } = report;
    let mut last = [const { String::new() }; 3];
    let points: Vec<Value> = points.iter().map(|point| of_point(point, &mut last)).collect();
    json!({
        "program": program,
        "files": files,
        "model": model,
        "achieved": *after == After::Achieved,
        "held_out_mm": held_out_mm.map(exact),
        "turn_sigma_rad": turn_sigma_rad.map(exact),
        "assumptions": assumptions,
        "missing": missing,
        "differences": differences,
        "between": between.as_ref().map(of_between),
        "points": points,
    })
}

/// The report of a record; `None` if the value is not one.
pub fn from_kept(value: &Value) -> Option<PathReport> {
    let mut last = [None; 3];
    let points = value["points"].as_array()?.iter();
    Some(PathReport {
        program: value["program"].as_str()?.to_owned(),
        files: serde_json::from_value(value["files"].clone()).ok()?,
        model: value["model"].as_str()?.to_owned(),
        after: if value["achieved"].as_bool()? { After::Achieved } else { After::PredictedRemainder },
        held_out_mm: number_or_none(&value["held_out_mm"])?,
        turn_sigma_rad: number_or_none(&value["turn_sigma_rad"])?,
        assumptions: serde_json::from_value(value["assumptions"].clone()).ok()?,
        missing: serde_json::from_value(value["missing"].clone()).ok()?,
        differences: serde_json::from_value(value["differences"].clone()).ok()?,
        between: match &value["between"] {
            Value::Null => None,
            between => Some(to_between(between)?),
        },
        points: points.map(|point| to_point(point, &mut last)).collect::<Option<_>>()?,
    })
}

/// A number that may be missing; `None` if the value is neither.
fn number_or_none(value: &Value) -> Option<Option<f64>> {
    match value {
        Value::Null => Some(None),
        number => Some(Some(number.as_str()?.parse().ok()?)),
    }
}

fn of_between(between: &BetweenTargets) -> Value {
    let BetweenTargets {
        tolerance_mm,
        largest_mm,
        beyond,
        beyond_lines,
        unchecked,
        unchecked_lines,
        first_lines,
    } = between;
    let largest_mm = largest_mm.map(exact);
    json!([exact(*tolerance_mm), largest_mm, beyond, beyond_lines, unchecked, unchecked_lines, first_lines])
}

fn to_between(value: &Value) -> Option<BetweenTargets> {
    let [tolerance_mm, largest_mm, beyond, beyond_lines, unchecked, unchecked_lines, first_lines] =
        value.as_array()?.as_slice()
    else {
        return None;
    };
    let number = |value: &Value| value.as_str()?.parse().ok();
    let count = |value: &Value| usize::try_from(value.as_u64()?).ok();
    let lines = |value: &Value| value.as_str().map(str::to_owned);
    Some(BetweenTargets {
        tolerance_mm: number(tolerance_mm)?,
        largest_mm: if largest_mm.is_null() { None } else { Some(number(largest_mm)?) },
        beyond: count(beyond)?,
        beyond_lines: lines(beyond_lines),
        unchecked: count(unchecked)?,
        unchecked_lines: lines(unchecked_lines),
        first_lines: lines(first_lines),
    })
}

fn of_point(point: &PathPoint, last: &mut [String; 3]) -> Value {
    // Destructured by field, so that a new field cannot be forgotten.
    let PathPoint {
        index,
        file,
        line,
        instruction,
        kind,
        cutting,
        base_from_object,
        part,
        part_from_object,
        flange_from_tool,
        intended,
        normal,
        joints_before,
        joints_after,
        before,
        after,
        sigma_mm,
        shape_sigma_mm,
        outside,
        status,
        reason,
    } = point;
    let mut words = Vec::new();
    for (pose, last) in [base_from_object, part_from_object, flange_from_tool].into_iter().zip(last) {
        let text = numbers(of_pose(pose));
        words.push(if *last == text { SAME.to_owned() } else { text.clone() });
        *last = text;
    }
    words.push(numbers(of_pose(intended)));
    words.push(optional(normal.map(|v| [v.x, v.y, v.z])));
    for joints in [joints_before, joints_after] {
        words.push(optional(joints.map(<[f64; 6]>::from)));
    }
    for side in [before, after] {
        let deviation = |d: &Deviation| [d.vector_mm.x, d.vector_mm.y, d.vector_mm.z, d.angle_rad];
        words.push(optional(side.as_ref().map(deviation)));
        words.push(optional(side.and_then(|d| d.normal_mm).map(|mm| [mm])));
    }
    words.push(optional(sigma_mm.map(|mm| [mm])));
    words.push(optional(shape_sigma_mm.map(|mm| [mm])));
    words.push(match outside {
        None => NONE.to_owned(),
        Some(Outside::Joint { joint, by_deg }) => format!("joint {joint} {}", exact(*by_deg)),
        Some(Outside::Coverage { ratio }) => format!("coverage {}", exact(*ratio)),
    });
    let kind = KINDS.iter().find(|(known, _)| known == kind).map(|(_, word)| *word);
    json!([index, file, line, instruction, kind, cutting, part, status, reason, words.join(" ")])
}

fn to_point(value: &Value, last: &mut [Option<Pose>; 3]) -> Option<PathPoint> {
    let [index, file, line, instruction, kind, cutting, part, status, reason, words] =
        value.as_array()?.as_slice()
    else {
        return None;
    };
    let mut words = words.as_str()?.split(' ');
    let words = &mut words;
    for last in last.iter_mut() {
        *last = Some(pose(words.next()?, words, last.as_ref())?);
    }
    let [base_from_object, part_from_object, flange_from_tool] = [last[0]?, last[1]?, last[2]?];
    let intended = pose(words.next()?, words, None)?;
    let normal = read::<3>(words)?.map(Vector3::from);
    let [joints_before, joints_after] =
        [read::<6>(words)?.map(Joints::from), read::<6>(words)?.map(Joints::from)];
    let mut side = || {
        let (found, normal) = (read::<4>(words)?, read::<1>(words)?);
        Some(found.map(|[x, y, z, angle_rad]| Deviation {
            vector_mm: Vector3::new(x, y, z),
            angle_rad,
            normal_mm: normal.map(|[mm]| mm),
        }))
    };
    let [before, after] = [side()?, side()?];
    let mut one = || Some(read::<1>(words)?.map(|[mm]| mm));
    let [sigma_mm, shape_sigma_mm] = [one()?, one()?];
    let outside = match words.next()? {
        "joint" => {
            let joint = words.next()?.parse().ok()?;
            Some(Outside::Joint { joint, by_deg: words.next()?.parse().ok()? })
        }
        "coverage" => Some(Outside::Coverage { ratio: words.next()?.parse().ok()? }),
        NONE => None,
        _ => return None,
    };
    let kind = kind.as_str()?;
    Some(PathPoint {
        index: usize::try_from(index.as_u64()?).ok()?,
        file: u32::try_from(file.as_u64()?).ok()?,
        line: u32::try_from(line.as_u64()?).ok()?,
        instruction: instruction.as_str()?.to_owned(),
        kind: KINDS.iter().find(|(_, word)| *word == kind)?.0,
        cutting: cutting.as_bool()?,
        base_from_object,
        part: u32::try_from(part.as_u64()?).ok()?,
        part_from_object,
        flange_from_tool,
        intended,
        normal,
        joints_before,
        joints_after,
        before,
        after,
        sigma_mm,
        shape_sigma_mm,
        outside,
        status: serde_json::from_value(status.clone()).ok()?,
        reason: reason.as_str().map(str::to_owned),
    })
}

fn numbers<const N: usize>(values: [f64; N]) -> String {
    values.map(exact).join(" ")
}

fn optional<const N: usize>(values: Option<[f64; N]>) -> String {
    values.map_or_else(|| NONE.to_owned(), numbers)
}

fn read<'w, const N: usize>(words: &mut impl Iterator<Item = &'w str>) -> Option<Option<[f64; N]>> {
    let first = words.next()?;
    if first == NONE { Some(None) } else { from(first, words).map(Some) }
}

fn from<'w, const N: usize>(first: &str, rest: &mut impl Iterator<Item = &'w str>) -> Option<[f64; N]> {
    let mut out = [first.parse().ok()?; N];
    for value in &mut out[1..] {
        *value = rest.next()?.parse().ok()?;
    }
    Some(out)
}

fn of_pose(pose: &Pose) -> [f64; 7] {
    let (at, turn) = (pose.translation.vector, pose.rotation.quaternion());
    [at.x, at.y, at.z, turn.w, turn.i, turn.j, turn.k]
}

fn pose<'w>(first: &str, rest: &mut impl Iterator<Item = &'w str>, last: Option<&Pose>) -> Option<Pose> {
    if first == SAME {
        return last.copied();
    }
    let [x, y, z, w, i, j, k] = from(first, rest)?;
    // Not normalised again, to keep every bit.
    let turn = UnitQuaternion::new_unchecked(Quaternion::new(w, i, j, k));
    Some(Pose::from_parts(Translation3::new(x, y, z), turn))
}
