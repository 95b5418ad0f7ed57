//! A page with everything on it. The test leaves it in the build folder, to be looked at.

use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use truegrind_report::document::{Block, Document, Figure, KeyFigure, PageVerdict, Provenance, Source};
use truegrind_report::format::{html, markdown, terminal};
use truegrind_report::number::Precision;
use truegrind_report::plot::{
    Axis, BarGroup, Bars, ColorMap, Graph, HeatStrip, Histogram, Interval, Intervals, PlanPath, PlanView,
    Reference, Sample, Series, Span, Strip,
};
use truegrind_report::status::Status;
use truegrind_report::table::{Cell, Column, Table};

/// Deviations of a path of so many points, before and after.
fn deviations(points: usize) -> [Vec<f64>; 2] {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let mut noise = || random.random::<f64>() - 0.5;
    let before = (0..points)
        .map(|i| 1.5 + (i as f64 / 40.0).sin() + 0.5 * (i as f64 / 9.0).cos() + 0.25 * noise())
        .collect();
    let after = (0..points).map(|i| 0.18 + 0.08 * (i as f64 / 30.0).cos() + 0.12 * noise().abs()).collect();
    [before, after]
}

fn raster(values: &[f64], name: &str) -> PlanPath {
    let per_line = 40;
    let points = (0..values.len())
        .map(|i| {
            let (line, step) = (i / per_line, i % per_line);
            let along = if line % 2 == 0 { step } else { per_line - 1 - step };
            [300.0 + 5.0 * along as f64, -60.0 + 12.0 * line as f64]
        })
        .collect();
    PlanPath { name: name.to_owned(), points, values: values.to_vec() }
}

pub(super) fn everything() -> Document {
    let [before, after] = deviations(400);
    let mut page = Document::new("Report with everything on it <truegrind>");
    page.subtitle = "abb-irb-120, 400 path points; an example with invented numbers".to_owned();
    page.push(PageVerdict::new(
        Status::Warning,
        "The model may be used inside its region",
        ["converged after 9 iterations", "rank 27 of 28", "12 targets lie outside the measured region"],
    ));
    page.push(vec![
        KeyFigure::new("Held-out RMSE", 0.4623, 2, "mm").note("before: 2.18 mm").status(Status::Good),
        KeyFigure::new("Largest deviation", 1.127, 2, "mm").note("limit 1 mm").status(Status::Warning),
        KeyFigure::new("Refused targets", 3usize, 0, "").status(Status::Bad),
        KeyFigure::new("Repeatability", Cell::Missing, 3, "mm")
            .note("no pose was repeated")
            .status(Status::NotEvaluated),
    ]);
    page.push(PageVerdict::new(Status::Good, "Everything that was asked is done", Vec::<String>::new()));
    page.push(PageVerdict::new(
        Status::Bad,
        "The fit did not converge; no model was written",
        ["cost still falling after 200 iterations"],
    ));

    page.heading(2, "Deviation");
    page.paragraph("Deviation of each path point from the intended surface, under the model that made the correction: a predicted remainder, not an achieved accuracy.");
    let mut table8 = Table::new("Deviation of path points", {
        let mut columns = vec![Column::text("method", "Method")];
        columns.extend(
            (1..=5).map(|point| Column::number(format!("p{point}_mm"), format!("P{point}"), "mm", 2)),
        );
        columns.extend([Column::number("mean_mm", "Mean", "mm", 2), Column::number("sd_mm", "SD", "mm", 2)]);
        columns.push(Column::text("state", "State"));
        columns
    });
    table8.push([
        "before".into(),
        1.83.into(),
        3.42.into(),
        1.65.into(),
        (-0.95).into(),
        0.62.into(),
        1.69.into(),
        1.09.into(),
        Cell::Judged(Status::Bad, "over limit".into()),
    ]);
    table8.push([
        "LM".into(),
        0.91.into(),
        0.24.into(),
        0.14.into(),
        Cell::Missing,
        0.40.into(),
        0.42.into(),
        0.34.into(),
        Cell::Judged(Status::Warning, "one target refused".into()),
    ]);
    table8.push([
        "LTLM".into(),
        0.16.into(),
        0.38.into(),
        0.32.into(),
        (-0.10).into(),
        0.15.into(),
        0.22.into(),
        0.12.into(),
        Cell::Judged(Status::Good, String::new()),
    ]);
    table8.notes.push("– marks a point whose target was refused.".to_owned());
    page.push(table8);
    let along = |values: &[f64]| Series::sequence("", values).points;
    page.figure(
        Graph {
            title: "Deviation along the path".into(),
            x: Axis::new("path point", ""),
            y: Axis::new("deviation", "mm"),
            series: vec![
                Series::line("before", along(&before)),
                Series::line("after (predicted remainder)", along(&after)).plus_minus(&[0.15; 400]),
            ],
            references: vec![Reference::Horizontal(1.0, "tolerance 1 mm".into())],
            spans: vec![Span { range: [120.0, 160.0], name: "outside the measured region".into() }],
        }
        .svg(),
        "Deviation of each point before and after compensation. The band is the predicted 1σ.",
    );
    page.figure(
        Histogram {
            title: "Size of the deviations".into(),
            x: Axis::new("deviation", "mm"),
            samples: vec![Sample::new("before", before.clone()), Sample::new("after", after.clone())],
            bins: None,
        }
        .svg(),
        "How often each size of deviation occurs.",
    );
    page.figure(
        PlanView {
            title: String::new(),
            x: Axis::new("x", "mm"),
            y: Axis::new("y", "mm"),
            value: Axis::new("deviation", "mm"),
            colors: ColorMap::Viridis,
            paths: vec![raster(&before, "before"), raster(&after, "LTLM")],
        }
        .svg(),
        "The path from above, coloured by deviation; both panels share the colours.",
    );
    let signed: Vec<f64> = before.iter().map(|value| value - 1.5).collect();
    page.figure(
        PlanView {
            title: "Signed deviation along the surface normal".into(),
            x: Axis::new("x", "mm"),
            y: Axis::new("y", "mm"),
            value: Axis::new("deviation along the normal", "mm"),
            colors: ColorMap::CoolWarm,
            paths: vec![raster(&signed, "")],
        }
        .svg(),
        "Blue lies below the surface, red above.",
    );
    page.figure(
        HeatStrip {
            title: "Deviation along the path, every method".into(),
            x: Axis::new("path point", ""),
            value: Axis::new("deviation", "mm"),
            colors: ColorMap::Viridis,
            strips: (0..5)
                .map(|method| Strip {
                    name: ["before", "LM", "LTLM", "EKF", "UKF-VSLM"][method].to_owned(),
                    values: before.iter().map(|value| value / (1 + method) as f64).collect(),
                })
                .collect(),
        }
        .svg(),
        "One strip per method.",
    );

    page.heading(2, "Identification");
    let units = ["mm", "mm", "°", "°"];
    let rows: Vec<Interval> = (0..16)
        .map(|i| {
            let unit = units[i % 4];
            let prior = if unit == "mm" { 0.5 } else { 0.1 };
            let value = prior * (f64::from(i as u32) * 1.7).sin() * 1.6;
            let mut row = Interval::new(
                format!("{}{}", ["a", "d", "α", "θ"][i % 4], i / 4 + 1),
                unit,
                value,
                prior * (0.02 + 0.3 * ((i * 7) % 5) as f64 / 5.0),
                prior,
            );
            if i == 5 {
                row = Interval { value: 0.0, sigma: prior, determined: false, ..row };
            }
            row
        })
        .collect();
    page.figure(
        Intervals { title: "Identified parameters".into(), rows: rows.clone() }.svg(),
        "Change of each parameter from the data sheet, in units of its prior.",
    );
    let mut parameters = Table::new(
        "Parameters",
        vec![
            Column::text("name", "Parameter"),
            Column::significant("value", "Change", "", 2),
            Column::text("unit", "Unit"),
        ],
    );
    for row in &rows {
        parameters.push([
            row.name.as_str().into(),
            Cell::WithSigma { value: row.value, sigma: row.sigma },
            row.unit.as_str().into(),
        ]);
    }
    page.push(Block::Details { summary: "All parameters".into(), blocks: vec![parameters.into()] });
    let decay = |rate: f64, floor: f64| -> Vec<[f64; 2]> {
        (0..60).map(|i| [f64::from(i), 2.2 * (-rate * f64::from(i)).exp() + floor]).collect()
    };
    page.push(Figure::new(
        Graph {
            title: "Convergence".into(),
            x: Axis::new("iteration", ""),
            y: Axis::log("RMSE", "mm"),
            series: vec![
                Series::line("LM, fixed damping", decay(0.12, 0.34)),
                Series::line("LM, Nielsen", decay(0.9, 0.32)),
                Series::line("LTLM", decay(0.3, 0.32)),
                Series::line("EKF", decay(0.05, 0.47)),
                Series::line("UKF-VSLM", decay(0.2, 0.4)),
                Series::line("swarm", decay(0.03, 0.9)),
                Series::line("quadratic interpolated beetle antennae search", decay(0.02, 0.8)),
            ],
            references: vec![Reference::Horizontal(0.3, "noise floor 0.30 mm".into())],
            spans: Vec::new(),
        }
        .svg(),
        "RMSE after each iteration.",
    ));
    let cost: Vec<[f64; 2]> =
        (0..14).map(|i| [f64::from(i), 1e3 * 10f64.powf(-0.9 * f64::from(i))]).collect();
    page.figure(
        Graph {
            x: Axis::new("iteration", ""),
            y: Axis::log("cost above the optimum", "mm²"),
            series: vec![Series::line("", cost)],
            ..Graph::default()
        }
        .svg(),
        "A single curve over twelve decades.",
    );

    page.heading(2, "Diagnosis");
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let residuals: Vec<[f64; 2]> = (0..480)
        .map(|_| {
            let q = random.random::<f64>() * 320.0 - 160.0;
            [q, 0.8 * (2.0 * q.to_radians()).sin() + 0.3 * (random.random::<f64>() - 0.5)]
        })
        .collect();
    let cleaned: Vec<[f64; 2]> =
        residuals.iter().map(|[q, r]| [*q, r - 0.8 * (2.0 * q.to_radians()).sin()]).collect();
    page.figure(
        Graph {
            title: "Residual against joint 3".into(),
            x: Axis::new("q3", "°"),
            y: Axis::new("residual", "mm"),
            series: vec![
                Series::points("geometry only", residuals.clone()),
                Series::points("with gear eccentricity", cleaned.clone()),
            ],
            ..Graph::default()
        }
        .svg(),
        "The residual shows two waves per joint turn; with the effect they are gone.",
    );
    let binned: Vec<[f64; 2]> =
        (0..12).map(|i| [f64::from(i) * 25.0 - 140.0, (f64::from(i)).sin()]).collect();
    page.figure(
        Graph {
            title: "Predicted and measured".into(),
            x: Axis::new("measured", "mm"),
            y: Axis::new("predicted", "mm"),
            series: vec![
                Series::points("bins", binned.iter().map(|[_, y]| [*y, y * 0.9 + 0.05]).collect::<Vec<_>>())
                    .plus_minus(&[0.2; 12]),
            ],
            references: vec![Reference::Diagonal("equal".into())],
            spans: Vec::new(),
        }
        .svg(),
        "Points with error bars.",
    );

    page.heading(2, "Comparison");
    let methods = ["BC", "LM", "EKF", "PF", "SCA", "QIBAS", "SSLM", "LTLM"].map(str::to_owned).to_vec();
    let rmse = [2.18, 0.46, 0.58, 0.71, 0.92, 0.63, 0.34, 0.32];
    let group = |name: &str, factor: f64| BarGroup {
        deviations: rmse.iter().map(|value| Some(value * 0.1 * factor)).collect(),
        ..BarGroup::new(name, rmse.iter().enumerate().map(|(i, value)| (i != 3).then_some(value * factor)))
    };
    page.figure(
        Bars {
            title: "Held-out error, ten cases".into(),
            y: Axis::new("error", "mm"),
            names: methods.clone(),
            groups: vec![group("RMSE", 1.0), group("mean", 0.8), group("max", 1.8)],
            labels: Some(Precision::Decimals(2)),
        }
        .svg(),
        "Mean over ten cases; whiskers are one standard deviation. PF diverged.",
    );
    page.figure(
        Bars {
            title: "Time".into(),
            y: Axis::log("time per fit", "s"),
            names: methods,
            groups: vec![BarGroup::new(
                "",
                [None, Some(0.002), Some(0.04), Some(3.0), Some(7.5), Some(1.2), Some(0.003), Some(0.01)],
            )],
            labels: Some(Precision::Significant(2)),
        }
        .svg(),
        "Time on one core.",
    );
    let mut long = Table::new(
        "Path points",
        vec![
            Column::count("index", "Point"),
            Column::count("line", "Line"),
            Column::number("before_mm", "Before", "mm", 3),
            Column::number("after_mm", "After", "mm", 3),
        ],
    );
    for i in 0..before.len() {
        long.push([i.into(), (i + 12).into(), before[i].into(), after[i].into()]);
    }
    page.push(long.excerpt(60));
    page.push(Block::List(vec!["measure rows 120 to 160 again".into(), "fasten the outlet <now>".into()]));
    page.push(Block::Code(
        "truegrind compensate PART.mod --robot abb-irb-120 --model MODEL.toml -o OUT.mod".into(),
    ));
    page.heading(3, "Nothing to show");
    page.figure(Graph { y: Axis::new("deviation", "mm"), ..Graph::default() }.svg(), "A graph without data.");
    page.heading(2, "Provenance");
    page.push(Provenance {
        command: Some("truegrind identify DATA.csv --robot abb-irb-120".into()),
        method: Some("ltlm".into()),
        seed: Some(1),
        sources: vec![Source {
            name: "DATA.csv".into(),
            role: "Measurements".into(),
            sha256: Some("9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08".into()),
            rows: Some(480),
        }],
        ..Provenance::here()
    });
    page
}

#[test]
fn everything_in_every_format() {
    let page = everything();
    let html = html::document(&page);
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("report");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("everything.html"), &html).unwrap();
    std::fs::write(folder.join("everything.md"), markdown::document(&page)).unwrap();
    std::fs::write(folder.join("everything.txt"), terminal::document(&page, 100)).unwrap();
    assert_eq!(html, html::document(&everything()), "the same input gives the same bytes");
}

#[test]
fn a_page_is_whole_and_loads_nothing() {
    let html = html::document(&everything());
    super::plots::assert_well_formed(&html);
    for outside in
        ["http:", "https:", "//", "src=", "@import", "url(", "<script", "<link", "<iframe", "javascript"]
    {
        let found = html.find(outside).map(|at| &html[at.saturating_sub(60)..(at + 60).min(html.len())]);
        assert_eq!(found, None, "{outside}");
    }
    // The words of pictures can be searched, and every link of the contents has its place, once.
    assert!(html.contains(">deviation along the normal [mm]</text>"));
    let anchors: Vec<&str> =
        html.split("href=\"#").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert_eq!(anchors, ["deviation", "identification", "diagnosis", "comparison", "provenance"]);
    for anchor in anchors {
        assert_eq!(html.matches(&format!(" id=\"{anchor}\"")).count(), 1);
    }
}

#[test]
fn equal_headings_get_places_of_their_own() {
    let mut page = Document::new("t");
    for heading in ["Same", "Same", "–", "same!"] {
        page.heading(2, heading);
    }
    let html = html::document(&page);
    for id in ["same", "same-2", "section", "same-3"] {
        assert_eq!(html.matches(&format!("<h2 id=\"{id}\">")).count(), 1, "{id}");
    }
}

#[test]
fn a_terminal_shows_the_words_and_leaves_pictures_out() {
    let text = terminal::document(&everything(), 100);
    assert!(text.contains("[warning] The model may be used inside its region"));
    assert!(text.contains("Largest deviation  1.13 mm  [warning]  limit 1 mm"));
    // A section of pictures only has no heading either.
    assert!(!text.contains("Diagnosis") && text.contains("Deviation\n─────────\n"));
    assert!(text.lines().all(|line| line.chars().count() <= 100));
}
