//! Report of the logistic-tent map's uniformity over r.

use serde_json::{Value, json};

use crate::uniformity::UniformityResult;
use truegrind_report::document::{Block, Document, PageVerdict};
use truegrind_report::number::Precision;
use truegrind_report::plot::{Axis, Graph, Histogram, Reference, Sample, Series};
use truegrind_report::status::Status;
use truegrind_report::table::{Cell, Table};

/// Terminal.
pub(super) fn summary(page: &mut Document, result: &UniformityResult) {
    page.push(verdict(result));
    page.push(maps(result));
    page.push(table(result).excerpt(24));
}

/// Page.
pub(super) fn page(page: &mut Document, result: &UniformityResult) {
    page.push(verdict(result));
    page.heading(2, "Standard deviation of the counts over r");
    for (long, points) in [(false, result.settings.points), (true, result.settings.long_points)] {
        page.figure(
            over_r(result, long),
            format!(
                "{} points in {} bins, mean of {} starts; the band is one standard deviation over the starts. The \
                 horizontal line is the value for random points.",
                thousands(points),
                result.settings.bins, result.settings.starts
            ),
        );
    }
    page.heading(2, "The sequence");
    page.figure(
        Graph {
            title: format!("Logistic-tent map, r = {}", result.settings.claimed),
            x: Axis::new("step", ""),
            y: Axis::new("value", ""),
            series: vec![Series::points(
                "",
                result.points.iter().enumerate().map(|(i, x)| [i as f64 + 1.0, *x]).collect::<Vec<_>>(),
            )],
            ..Graph::default()
        }
        .svg(),
        "The paper's Fig. 3a, from one start.",
    );
    page.figure(
        Histogram {
            title: format!("Counts of the same {} points", thousands(result.settings.points)),
            x: Axis::new("value", ""),
            samples: vec![Sample::new("logistic-tent", result.points.clone())],
            bins: Some(result.settings.bins),
        }
        .svg(),
        format!(
            "The paper's Fig. 3b. {} in each bin would be uniform; counts of random points scatter by as much as these.",
            Precision::Significant(3).format(result.settings.points as f64 / result.settings.bins as f64)
        ),
    );
    page.heading(2, "Comparison of the maps");
    page.push(maps(result));
    page.push(Block::Details {
        summary: format!("All {} values of r", result.settings.steps),
        blocks: vec![table(result).into()],
    });
}

/// 100,000.
fn thousands(count: usize) -> String {
    let digits = count.to_string();
    let cut = digits.len() % 3;
    let (head, rest) = digits.split_at(cut);
    let groups = rest.as_bytes().chunks(3).map(|g| String::from_utf8_lossy(g).into_owned());
    let head = Some(head.to_owned()).filter(|h| !h.is_empty());
    head.into_iter().chain(groups).collect::<Vec<_>>().join(",")
}

/// The maps of Table 2.
fn maps(result: &UniformityResult) -> Table {
    let settings = &result.settings;
    Table::of("Standard deviation of the counts, the maps of the paper's Table 2", &result.maps)
        .text("map", "Map", |of| of.map.name())
        .number("short", &format!("{} points", thousands(settings.points)), "", 1, |of| {
            Cell::with_sigma(of.short.deviation, Some(of.short.spread))
        })
        .number("short_random", "random", "", 1, |of| of.short.random)
        .number("long", &format!("{} points", thousands(settings.long_points)), "", 0, |of| {
            Cell::with_sigma(of.long.deviation, Some(of.long.spread))
        })
        .number("long_random", "random", "", 0, |of| of.long.random)
        .note(format!(
            "± is the standard deviation over {} starts. Tent and Bernoulli would collapse to 0 in binary floating point, so \
             random bits are appended at the low end. Logistic, sine, Chebyshev and Hénon have non-uniform densities by \
             design.",
            settings.starts
        ))
        .table()
}

fn verdict(result: &UniformityResult) -> PageVerdict {
    let verdict = &result.study.verdict;
    let claimed = verdict.claimed;
    let headline = if verdict.sampling_noise {
        format!("\"r = {claimed} is the most uniform\" is sampling noise")
    } else {
        format!("r = {claimed} cannot be ruled out as the most uniform")
    };
    let all = result.settings.steps;
    let random = result.study.points.first();
    let mut reasons = vec![
        format!(
            "With {} points, {} of {all} values of r lie within one sampling spread of r = {claimed}, or below; the smallest is r = {:.2}.",
            thousands(result.settings.points),
            verdict.indistinguishable_short,
            verdict.best_short
        ),
        format!(
            "With {} points, {} values of r are more uniform by more than one sampling spread; the smallest is r = {:.2}.",
            thousands(result.settings.long_points),
            verdict.better_long,
            verdict.best_long
        ),
    ];
    if let Some(point) = random {
        reasons.push(format!(
            "Random points give {:.1} ± {:.1} and {:.1} ± {:.1}.",
            point.short.random, point.short.random_spread, point.long.random, point.long.random_spread
        ));
    }
    reasons.push(
        "This does no harm: a line search over about ten candidates does not need uniform points.".to_owned(),
    );
    PageVerdict::new(if verdict.sampling_noise { Status::Warning } else { Status::Good }, headline, reasons)
}

fn over_r(result: &UniformityResult, long: bool) -> String {
    let of = |p: &truegrind_estimation::chaos::uniformity::Point| if long { p.long } else { p.short };
    let points: Vec<[f64; 2]> = result.study.points.iter().map(|p| [p.r, of(p).deviation]).collect();
    let spreads: Vec<f64> = result.study.points.iter().map(|p| of(p).spread).collect();
    let random = result.study.points.first().map_or(f64::NAN, |p| of(p).random);
    Graph {
        title: format!(
            "{} points",
            thousands(if long { result.settings.long_points } else { result.settings.points })
        ),
        x: Axis::new("r", ""),
        y: Axis::log("standard deviation of the counts", ""),
        series: vec![Series::line("logistic-tent", points).plus_minus(&spreads)],
        references: vec![
            Reference::Horizontal(random, "random points".to_owned()),
            Reference::Vertical(result.settings.claimed, "the paper's choice".to_owned()),
        ],
        ..Graph::default()
    }
    .svg()
}

/// One row for each r.
pub(super) fn table(result: &UniformityResult) -> Table {
    let settings = &result.settings;
    Table::of("Standard deviation of the counts", &result.study.points)
        .number("r", "r", "", 2, |point| point.r)
        .number("short", &format!("{} points", thousands(settings.points)), "", 2, |point| {
            Cell::with_sigma(point.short.deviation, Some(point.short.spread))
        })
        .number("short_random", "random", "", 2, |point| point.short.random)
        .number("long", &format!("{} points", thousands(settings.long_points)), "", 1, |point| {
            Cell::with_sigma(point.long.deviation, Some(point.long.spread))
        })
        .number("long_random", "random", "", 1, |point| point.long.random)
        .note(format!("± is the standard deviation over {} starts.", settings.starts))
        .table()
}

/// Everything.
pub(super) fn json(result: &UniformityResult) -> Value {
    json!({
        "settings": result.settings,
        "points": result.study.points,
        "maps": result.maps,
        "verdict": result.study.verdict,
    })
}
