//! Plots of a path: deviation along the path, histogram, and plan view of the workpiece.

use std::collections::BTreeSet;

use super::side::{AFTER, BEFORE, Side, has, intended};
use super::words::meaning;
use crate::document::Figure;
use crate::plot::{
    Axis, ColorMap, Graph, HeatStrip, Histogram, Ink, PlanPath, PlanView, Sample, Series, Span, Strip,
    distinguishable,
};
use truegrind_compensation::deviation::{After, MotionStatus, PathPoint, PathReport};
use truegrind_math::statistics;

/// Largest number of plotted points; of each group of neighbours the largest deviation is kept.
const POINTS: usize = 2000;

/// Largest number of models in one plot.
const MODELS: usize = 5;

/// All plots of one program.
pub(super) fn all(reports: &[&PathReport]) -> Vec<Figure> {
    let mut out = vec![along(reports)];
    out.push(frequency(reports));
    out.extend(strips(reports));
    out.extend(plan(reports));
    out
}

/// One side of one report.
struct Shown<'a> {
    name: String,
    report: &'a PathReport,
    side: Side,
    after: bool,
    ink: Option<Ink>,
}

impl Shown<'_> {
    /// Whether it is the remainder of the solver, which says nothing about the deviation of the real arm.
    fn is_remainder(&self) -> bool {
        self.after && self.report.after == After::PredictedRemainder
    }
}

/// All curves: before (once if all reports agree), then after.
fn shown<'a>(reports: &[&'a PathReport]) -> Vec<Shown<'a>> {
    let mut out = Vec::new();
    let Some(first) = reports.first() else { return out };
    let several = reports.len() > 1;
    let differ = reports.iter().any(|report| report.signed_mm(BEFORE) != first.signed_mm(BEFORE));
    for (index, report) in reports.iter().take(if differ { MODELS } else { 1 }).enumerate() {
        if has(report, BEFORE) {
            let name = if differ { format!("before, under {}", report.model) } else { "before".to_owned() };
            let ink = (index == 0).then_some(Ink::Vermilion);
            out.push(Shown { name, report, side: BEFORE, after: false, ink });
        }
    }
    for report in reports.iter().filter(|report| has(report, AFTER)).take(MODELS) {
        let word = meaning(report.after);
        let name = if several { format!("{}, {word}", report.model) } else { format!("after ({word})") };
        out.push(Shown { name, report, side: AFTER, after: true, ink: (!several).then_some(Ink::Blue) });
    }
    out
}

/// What a plan shows in place of the predicted remainder.
const EXPECTED: &str = "expected, 1σ";

/// Joins the names of coinciding curves.
const SAME: &str = " = ";

const SIGNED: &str = "deviation along the normal";

const SIZE: &str = "size of the deviation";

fn quantity(reports: &[&PathReport]) -> &'static str {
    let signed = reports.iter().flat_map(|report| report.cut()).all(|point| point.normal.is_some());
    if signed { SIGNED } else { SIZE }
}

fn along(reports: &[&PathReport]) -> Figure {
    let single = reports.len() == 1;
    let mut band = false;
    let series: Vec<Series> = shown(reports)
        .into_iter()
        .map(|Shown { name, report, side, after, ink }| {
            let kept = thinned(report, side);
            let points: Vec<[f64; 2]> = kept
                .iter()
                .map(|point| [point.index as f64, side(point).map_or(f64::NAN, |d| d.signed_mm())])
                .collect();
            let mut series = Series { ink, ..Series::line(name, points) };
            // The band belongs to the path that will be run: after, or before if nothing was corrected. Approaches have the 1σ of
            // the place, which would dominate the scale if only the shape of the cut is corrected, so they get no band.
            let cuts = report.points.iter().any(|p| p.cutting);
            let sigma = |p: &PathPoint| p.sigma_mm.filter(|_| p.cutting || !cuts);
            if single && (after || !has(report, AFTER)) && kept.iter().any(|p| sigma(p).is_some()) {
                let sigmas: Vec<f64> = kept.iter().map(|p| sigma(p).unwrap_or(0.0)).collect();
                series = series.plus_minus(&sigmas);
                if quantity(reports) != SIGNED {
                    // A size is never negative.
                    series.bounds.iter_mut().for_each(|bounds| bounds[0] = bounds[0].max(0.0));
                }
                band = true;
            }
            series
        })
        .collect();
    let passing = passing(reports);
    let (mut series, alike) = distinguishable(series, |x| !passing.contains(&x.to_bits()));
    for (name, same) in &alike {
        if let Some(drawn) = series.iter_mut().find(|one| one.name.split(SAME).next() == Some(same)) {
            drawn.name = format!("{}{SAME}{name}", drawn.name);
        }
    }
    let graph = Graph {
        title: "Deviation along the path".to_owned(),
        x: Axis::new("path point", ""),
        y: Axis::new(quantity(reports), "mm"),
        series,
        spans: reports.first().map_or(Vec::new(), |report| spans(report)),
        ..Graph::default()
    };
    let mut caption = String::from("Deviation at each point of the path, including approaches and links.");
    if band {
        caption
            .push_str(" The band is the predicted ±1σ of the model along the cut, in which the real arm is expected to run.");
    }
    if !alike.is_empty() {
        caption.push_str(" Names joined by = share a curve: they coincide along the cut.");
    }
    if !graph.spans.is_empty() {
        caption.push_str(" Shaded: points that were refused, flagged or left.");
    }
    if reports.iter().any(|report| report.points.len() > POINTS) {
        caption
            .push_str(" Of each group of neighbouring points the one with the largest deviation is drawn.");
    }
    Figure::new(graph.svg(), caption)
}

/// Points outside the cuts, by position; empty for a path without a cut.
fn passing(reports: &[&PathReport]) -> BTreeSet<u64> {
    let points = || reports.iter().flat_map(|report| &report.points);
    let cuts = points().any(|point| point.cutting);
    points().filter(|point| cuts && !point.cutting).map(|point| (point.index as f64).to_bits()).collect()
}

fn frequency(reports: &[&PathReport]) -> Figure {
    // More than two histograms would hide each other.
    let one = &reports[..reports.len().min(1)];
    let samples = shown(one)
        .into_iter()
        .filter(|shown| !shown.is_remainder())
        .map(|s| Sample { ink: s.ink, ..Sample::new(s.name, s.report.signed_mm(s.side)) })
        .collect();
    let histogram = Histogram {
        title: "How often each deviation occurs".to_owned(),
        x: Axis::new(quantity(one), "mm"),
        samples,
        bins: None,
    };
    let achieved = one.iter().any(|report| report.after == After::Achieved && has(report, AFTER));
    let mut caption = format!(
        "Deviations of the points of the cut, before {}",
        if achieved { "and after" } else { "the correction" }
    );
    if let ([report], true) = (one, reports.len() > 1) {
        caption.push_str(&format!(" with {}", report.model));
    }
    Figure::new(histogram.svg(), caption + ".")
}

/// `None` for a single strip, which shows no more than the curve.
fn strips(reports: &[&PathReport]) -> Option<Figure> {
    let signed = quantity(reports) == SIGNED;
    let strips: Vec<Strip> = shown(reports)
        .into_iter()
        .filter(|shown| !shown.is_remainder())
        .map(|Shown { name, report, side, .. }| Strip { name, values: report.signed_mm(side) })
        .collect();
    if reports.len() < 2 || strips.len() < 2 {
        return None;
    }
    let strip = HeatStrip {
        title: "Model by model".to_owned(),
        x: Axis::new("point of the cut", ""),
        value: Axis::new(quantity(reports), "mm"),
        colors: if signed { ColorMap::CoolWarm } else { ColorMap::Viridis },
        strips,
    };
    Some(Figure::new(strip.svg(), "Deviation along the cut, one strip per model on a common scale."))
}

fn plan(reports: &[&PathReport]) -> Option<Figure> {
    let first = reports.first()?;
    let axes = widest(first)?;
    // A σ has no sign: on a signed scale beside it an uncorrected path of small deviations would look like the better one.
    let shows_sigma = shown(reports).iter().any(Shown::is_remainder);
    let signed = quantity(reports) == SIGNED && !shows_sigma;
    let names = ["x", "y", "z"];
    let cuts = first.points.iter().any(|point| point.cutting);
    let paths: Vec<PlanPath> = shown(reports)
        .into_iter()
        .map(|shown| {
            let remainder = shown.is_remainder();
            let Shown { name, report, side, .. } = shown;
            let kept = thinned(report, side);
            let points = kept.iter().map(|point| axes.map(|axis| intended(point)[axis])).collect();
            let value = |point: &&PathPoint| match side(point) {
                Some(_) if remainder && point.cutting => point.expected_mm().unwrap_or(f64::NAN),
                Some(d) if point.cutting || !cuts => {
                    if signed {
                        d.signed_mm()
                    } else {
                        d.norm_mm()
                    }
                }
                _ => f64::NAN,
            };
            let name = if remainder { name.replace(meaning(report.after), EXPECTED) } else { name };
            PlanPath { name, points, values: kept.iter().map(value).collect() }
        })
        .collect();
    let view = PlanView {
        title: "Where on the part".to_owned(),
        x: Axis::new(names[axes[0]], "mm"),
        y: Axis::new(names[axes[1]], "mm"),
        value: Axis::new(if signed { SIGNED } else { SIZE }, "mm"),
        colors: if signed { ColorMap::CoolWarm } else { ColorMap::Viridis },
        paths,
    };
    let after = reports.iter().find(|report| has(report, AFTER)).map_or("", |report| match report.after {
        After::PredictedRemainder => " (after: size of the expected deviation, from the predicted 1σ)",
        After::Achieved => " (after: achieved)",
    });
    Some(Figure::new(
        view.svg(),
        format!(
            "The path in the work object, viewed along {}, coloured by its deviation; all panels share one scale{}. \
             Approaches and links are grey.",
            names[3 - axes[0] - axes[1]],
            after
        ),
    ))
}

/// The two axes of the work object along which the path extends furthest.
fn widest(report: &PathReport) -> Option<[usize; 2]> {
    let extent = |axis: usize| {
        let [low, high] = statistics::extent(report.cut().map(|point| intended(point)[axis]));
        high - low
    };
    if report.points.is_empty() {
        return None;
    }
    let shortest = (0..3).rev().min_by(|&a, &b| extent(a).total_cmp(&extent(b)))?;
    let mut axes = (0..3).filter(|axis| *axis != shortest);
    Some([axes.next()?, axes.next()?])
}

/// Points to plot: all, or of each group the one with the largest deviation.
fn thinned(report: &PathReport, side: Side) -> Vec<&PathPoint> {
    let size = |point: &&PathPoint| side(point).map_or(-1.0, |d| d.norm_mm());
    report
        .points
        .chunks(report.points.len().div_ceil(POINTS).max(1))
        .filter_map(|group| group.iter().max_by(|a, b| size(a).total_cmp(&size(b))))
        .collect()
}

/// Ranges of points that were refused, flagged or left; empty if no point was changed.
fn spans(report: &PathReport) -> Vec<Span> {
    if report.points.iter().all(|point| point.status != MotionStatus::Changed) {
        return Vec::new();
    }
    let mut out: Vec<Span> = Vec::new();
    for point in &report.points {
        let name = match point.status {
            MotionStatus::Changed => continue,
            MotionStatus::Refused => "refused",
            MotionStatus::Flagged => "flagged",
            MotionStatus::Left => "left",
        };
        let (from, to) = (point.index as f64 - 0.5, point.index as f64 + 0.5);
        match out.last_mut() {
            Some(last) if last.name == name && last.range[1] == from => last.range[1] = to,
            _ => out.push(Span { range: [from, to], name: name.to_owned() }),
        }
    }
    out
}
