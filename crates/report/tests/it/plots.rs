use proptest::prelude::*;
use truegrind_report::number::Precision;
use truegrind_report::plot::{
    Axis, BarGroup, Bars, ColorMap, Graph, HeatStrip, Histogram, Interval, Intervals, PlanPath, PlanView,
    Reference, Sample, Series, Span, Strip, distinguishable, linear_ticks, log_ticks,
};

/// Every tag is closed in order, every attribute quoted, no `<` or bare `&` in text. HTML's void elements may stay open.
pub(super) fn assert_well_formed(markup: &str) {
    const VOID: [&str; 2] = ["meta", "!doctype"];
    let mut open: Vec<&str> = Vec::new();
    let mut rest = markup;
    while let Some(start) = rest.find('<') {
        let text = &rest[..start];
        if open.last() != Some(&"style") {
            for (at, _) in text.match_indices('&') {
                let entity = text[at..].split_once(';').unwrap_or_else(|| panic!("bare & in {text:?}")).0;
                assert!(
                    entity[1..].chars().all(|c| c.is_ascii_alphanumeric() || c == '#'),
                    "bare & in {text:?}"
                );
            }
            assert!(!text.contains('>'), "bare > in {text:?}");
        }
        let end = start + tag_length(&rest[start..]);
        let tag = &rest[start + 1..end - 1];
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name), "</{name}> closes another element");
        } else {
            let name = tag.split(|c: char| c.is_whitespace() || c == '/').next().expect("a name");
            assert!(!name.is_empty() && tag.matches('"').count().is_multiple_of(2), "bad tag <{tag}>");
            let bare: String = tag.split('"').step_by(2).collect();
            assert!(!bare.contains('\'') && !bare.contains('<'), "bad attribute in <{tag}>");
            if !tag.ends_with('/') && !VOID.contains(&name) {
                open.push(name);
            }
        }
        rest = &rest[end..];
    }
    assert_eq!(open, Vec::<&str>::new(), "elements left open");
}

/// Length of a tag up to its `>`, which may also stand inside quotes.
fn tag_length(markup: &str) -> usize {
    let mut quoted = false;
    for (at, character) in markup.char_indices() {
        match character {
            '"' => quoted = !quoted,
            '>' if !quoted => return at + 1,
            _ => {}
        }
    }
    panic!("tag without an end: {}", &markup[..markup.len().min(80)]);
}

fn assert_sound(svg: &str) {
    assert_well_formed(svg);
    assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 900 "));
    assert!(svg.ends_with("</svg>\n"));
    for wrong in ["NaN", "inf", "could not be drawn", "href", "url("] {
        assert!(!svg.contains(wrong), "{wrong} in {svg}");
    }
}

#[test]
fn the_checker_finds_faults() {
    for faulty in ["<a><b></a></b>", "<a>", "<a>x & y</a>", "<a x='1'></a>", "</a>"] {
        assert!(std::panic::catch_unwind(|| assert_well_formed(faulty)).is_err(), "{faulty}");
    }
    assert_well_formed("<a x=\"1 > 0\">x &amp; y<b/></a>");
}

#[test]
fn text_stays_text_and_is_escaped() {
    let graph = Graph {
        title: "before & after <LM>".into(),
        x: Axis::new("path point", ""),
        y: Axis::new("deviation", "mm"),
        series: vec![
            Series::line("\"raw\"", [[0.0, 1.0], [1.0, 2.0]]),
            Series::line("fit", [[0.0, 1.0], [1.0, 1.5]]),
        ],
        references: [1.8, -1.8].map(|y| Reference::Horizontal(y, "limit".into())).into(),
        spans: vec![Span { range: [0.2, 0.4], name: "rows 3–5".into() }],
    };
    let svg = graph.svg();
    assert_sound(&svg);
    for words in [
        "before &amp; after &lt;LM&gt;",
        "path point",
        "deviation [mm]",
        "&quot;raw&quot;",
        "fit",
        "limit",
        "rows 3–5",
    ] {
        assert_eq!(svg.matches(&format!(">{words}</text>")).count(), 1, "{words}");
    }
    assert_eq!(svg, graph.svg());
}

/// Places of the numbers of a `points` attribute of the first element drawn in a colour.
fn points_of(svg: &str, color: &str) -> Vec<[f64; 2]> {
    let inside = svg.split("<svg ").nth(2).expect("a drawn line");
    let line = inside
        .lines()
        .find(|line| line.starts_with("<polyline") && line.contains(color))
        .expect("a drawn line");
    let points = line.split('"').nth(1).expect("a drawn line");
    points
        .split(' ')
        .map(|point| {
            let (x, y) = point.split_once(',').expect("a drawn line");
            [x.parse().expect("a drawn line"), y.parse().expect("a drawn line")]
        })
        .collect()
}

#[test]
fn points_lie_where_the_axes_say() {
    let plot = |log: bool, values: [f64; 3]| {
        let svg = Graph {
            y: Axis { log, range: Some([1.0, 100.0]), ..Axis::default() },
            series: vec![Series::line("", [[0.0, values[0]], [1.0, values[1]], [4.0, values[2]]])],
            ..Graph::default()
        }
        .svg();
        points_of(&svg, "#D55E00")
    };
    for (log, values) in [(false, [1.0, 50.5, 100.0]), (true, [1.0, 10.0, 100.0])] {
        let [first, middle, last] = plot(log, values)[..] else { panic!("three points") };
        // Half way up and a quarter across, to the tenth of a pixel.
        assert!((middle[1] - (first[1] + last[1]) / 2.0).abs() <= 0.11);
        assert!((middle[0] - (first[0] + (last[0] - first[0]) / 4.0)).abs() <= 0.11);
        assert!(first[1] > last[1] && first[1] - last[1] > 300.0, "most of 420 pixels are for the data");
    }
}

#[test]
fn gaps_stay_gaps() {
    let values = [1.0, 2.0, f64::NAN, 3.0, f64::INFINITY, 1.0, 2.0];
    let svg = Graph { series: vec![Series::sequence("", &values)], ..Graph::default() }.svg();
    assert_sound(&svg);
    let inside = svg.split("<svg ").nth(2).unwrap();
    assert_eq!(inside.matches("<polyline").count(), 2, "before the first gap and after the last");
    assert_eq!(inside.matches("<circle").count(), 1, "the lone 3 between gaps");
}

#[test]
fn a_long_line_is_thinned_but_keeps_its_peaks() {
    let mut values: Vec<f64> = (0..100_000).map(|i| (f64::from(i) * 0.7).sin()).collect();
    values[51_234] = 25.0;
    let graph = |values: &[f64]| Graph {
        y: Axis { range: Some([-5.0, 30.0]), ..Axis::default() },
        series: vec![Series::sequence("", values)],
        ..Graph::default()
    };
    let svg = graph(&values).svg();
    assert!(svg.len() < 200_000, "{} bytes", svg.len());
    let points = points_of(&svg, "#D55E00");
    let top = points.iter().map(|point| point[1]).fold(f64::INFINITY, f64::min);
    let few = points_of(&graph(&[0.0, 25.0]).svg(), "#D55E00");
    assert!((top - few[1][1]).abs() < 0.15, "the peak of 25 stands where 25 is");
}

#[test]
fn empty_constant_and_unusable_data_give_whole_pictures() {
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, 0.0];
    let cases: [&[f64]; 7] =
        [&[], &[0.0], &[-3.5; 4], &[1e300, -1e300], &[5e-324, 1e-310], &bad, &[f64::MAX, f64::MIN]];
    for values in cases {
        for log in [false, true] {
            let axis = Axis { log, ..Axis::new("v", "mm") };
            let points: Vec<[f64; 2]> = values.iter().map(|v| [*v, *v]).collect();
            let mut series = vec![Series::line("a", points.clone()), Series::points("b", points.clone())];
            series.push(Series::line("c", points.clone()).plus_minus(&vec![f64::NAN; values.len()]));
            let graph = Graph {
                title: "t".into(),
                x: axis.clone(),
                y: axis.clone(),
                series,
                references: vec![
                    Reference::Horizontal(f64::NAN, "n".into()),
                    Reference::Vertical(1.0, "o".into()),
                    Reference::Diagonal("p".into()),
                ],
                spans: vec![Span { range: [f64::NAN, 1.0], name: "q".into() }],
            };
            assert_sound(&graph.svg());
            let sample = Sample::new("a", values);
            assert_sound(&Histogram { x: axis.clone(), samples: vec![sample], ..Histogram::default() }.svg());
            let group = BarGroup {
                deviations: values.iter().map(|v| Some(*v)).collect(),
                ..BarGroup::new("g", values.iter().map(|v| Some(*v)))
            };
            let names = (0..values.len()).map(|i| format!("n{i}")).collect();
            let labels = Some(Precision::Significant(2));
            assert_sound(
                &Bars { title: String::new(), y: axis.clone(), names, groups: vec![group], labels }.svg(),
            );
            let path = PlanPath { name: "p".into(), points, values: values.to_vec() };
            for colors in [ColorMap::Viridis, ColorMap::CoolWarm] {
                let paths = vec![path.clone(); 2];
                assert_sound(&PlanView { value: axis.clone(), colors, paths, ..PlanView::default() }.svg());
                let strips = vec![Strip { name: "s".into(), values: values.to_vec() }];
                assert_sound(
                    &HeatStrip { value: axis.clone(), colors, strips, ..HeatStrip::default() }.svg(),
                );
            }
            let rows = values.iter().map(|v| Interval::new("a1", "mm", *v, v.abs(), 0.5));
            assert_sound(&Intervals { title: String::new(), rows: rows.collect() }.svg());
        }
    }
    for svg in [
        PlanView::default().svg(),
        HeatStrip::default().svg(),
        Histogram::default().svg(),
        Graph::default().svg(),
    ] {
        assert!(svg.contains(">no data</text>"));
    }
}

#[test]
fn bins_hold_every_finite_value() {
    let histogram =
        |values: Vec<f64>| Histogram { samples: vec![Sample::new("", values)], ..Histogram::default() };
    let bins = histogram(vec![0.1, 0.2, 0.3, 0.3, 0.7, f64::NAN, 1.0]).bins();
    assert_eq!(bins.counts[0].iter().sum::<usize>(), 6);
    let fixed = Histogram { bins: Some(4), ..histogram(vec![0.0, 0.5, 0.5, 1.0, 1.5, 2.0]) }.bins();
    assert_eq!(fixed.edges, [0.0, 0.5, 1.0, 1.5, 2.0]);
    // A bin holds its lower end, the last one both.
    assert_eq!(fixed.counts, [[1, 2, 1, 2]]);
    let constant = histogram(vec![3.0; 7]).bins();
    assert_eq!(constant.counts, [[7]]);
    assert!(constant.edges[0] < 3.0 && constant.edges[1] > 3.0);
}

proptest! {
    #[test]
    fn bins_are_even_and_sum_to_the_count(
        values in proptest::collection::vec(-1e3f64..1e3, 1..300),
        scale in -9i32..6,
        wanted in proptest::option::of(1usize..80),
    ) {
        let values: Vec<f64> = values.iter().map(|value| value * 10f64.powi(scale)).collect();
        let count = values.len();
        let samples = vec![Sample::new("all", values.clone()), Sample::new("half", &values[..count / 2])];
        let bins = Histogram { samples, bins: wanted, ..Histogram::default() }.bins();
        prop_assert_eq!(bins.counts[0].iter().sum::<usize>(), count);
        prop_assert_eq!(bins.counts[1].iter().sum::<usize>(), count / 2);
        let width = bins.edges[1] - bins.edges[0];
        for pair in bins.edges.windows(2) {
            prop_assert!(((pair[1] - pair[0]) / width - 1.0).abs() < 1e-6);
        }
    }

    /// Few, inside, ascending, evenly spaced, and each the shortest number that could stand there.
    #[test]
    fn linear_ticks_are_round(low in -1e3f64..1e3, span in 1e-6f64..1e3, scale in -12i32..9, wanted in 2usize..12) {
        let factor = 10f64.powi(scale);
        let (low, high) = (low * factor, (low + span) * factor);
        let ticks = linear_ticks(low, high, wanted);
        prop_assert!(ticks.len() <= wanted + 1, "{:?}", ticks);
        let slack = (high - low) * 1e-6;
        for pair in ticks.windows(2) {
            prop_assert!(pair[0] < pair[1]);
        }
        for tick in &ticks {
            prop_assert!(*tick >= low - slack && *tick <= high + slack);
        }
        if low.abs() < 100.0 * (high - low) {
            for tick in ticks {
                prop_assert!(format!("{tick:e}").len() < 14, "{tick:e} is not round");
            }
        }
    }

    #[test]
    fn log_ticks_are_round(low in -300f64..300.0, span in 0.01f64..600.0, wanted in 3usize..10) {
        let (low, high) = (10f64.powf(low), 10f64.powf((low + span).min(307.0)));
        let ticks = log_ticks(low, high, wanted);
        prop_assert!(ticks.len() <= wanted.max(12) && !ticks.is_empty(), "{low:e} to {high:e}: {:?}", ticks);
        for pair in ticks.windows(2) {
            prop_assert!(pair[0] < pair[1]);
        }
        for tick in &ticks {
            prop_assert!(*tick >= low * (1.0 - 1e-6) && *tick <= high * (1.0 + 1e-6));
        }
    }
}

#[test]
fn ticks_of_the_ranges_that_occur() {
    assert_eq!(log_ticks(1e-9, 1e3, 6), [1e-9, 1e-6, 1e-3, 1.0, 1e3]);
    assert_eq!(log_ticks(0.3, 2.2, 6), [0.5, 1.0, 2.0]);
    assert_eq!(linear_ticks(1e-9, 1e3, 6), [0.0, 200.0, 400.0, 600.0, 800.0, 1000.0]);
    assert_eq!(linear_ticks(0.0, 3e-4, 3), [0.0, 1e-4, 2e-4, 3e-4]);
    assert_eq!(linear_ticks(f64::NAN, 1.0, 3), Vec::<f64>::new());
    assert_eq!(log_ticks(-1.0, 1.0, 3), Vec::<f64>::new());
    let labels = |range: [f64; 2], log: bool| {
        let svg = Graph { y: Axis { log, range: Some(range), ..Axis::default() }, ..Graph::default() }.svg();
        svg.lines()
            .filter(|line| line.contains("text-anchor=\"end\""))
            .map(|line| line.split(['>', '<']).nth(2).unwrap().to_owned())
            .collect::<Vec<_>>()
    };
    assert_eq!(labels([0.0, 0.25], false), ["0.00", "0.05", "0.10", "0.15", "0.20", "0.25"]);
    assert_eq!(labels([0.0, 4e-7], false), ["0", "1·10⁻⁷", "2·10⁻⁷", "3·10⁻⁷", "4·10⁻⁷"]);
    assert_eq!(labels([0.01, 10.0], true), ["0.01", "0.1", "1", "10"]);
    assert_eq!(labels([1e-9, 1e3], true), ["10⁻⁹", "10⁻⁶", "10⁻³", "10⁰", "10³"]);
}

#[test]
fn viridis_rises_in_lightness_evenly() {
    // CIE L* of the sRGB colour.
    let lightness = |rgb: [u8; 3]| {
        let linear = rgb.map(|channel| {
            let channel = f64::from(channel) / 255.0;
            if channel <= 0.04045 { channel / 12.92 } else { ((channel + 0.055) / 1.055).powf(2.4) }
        });
        let luminance = 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
        116.0 * luminance.cbrt() - 16.0
    };
    let steps: Vec<f64> = (0..=20).map(|i| lightness(ColorMap::Viridis.at(f64::from(i) / 20.0))).collect();
    let mean = (steps[20] - steps[0]) / 20.0;
    for pair in steps.windows(2) {
        assert!((pair[1] - pair[0] - mean).abs() < 0.5 * mean, "{pair:?}");
    }
    // The signed map is as light below zero as above it.
    for i in 0..=10 {
        let part = f64::from(i) / 20.0;
        let sides = [0.5 - part, 0.5 + part].map(|fraction| lightness(ColorMap::CoolWarm.at(fraction)));
        assert!((sides[0] - sides[1]).abs() < 6.0, "{sides:?}");
    }
}

#[test]
fn legends_stand_above_the_data() {
    let series = (0..9)
        .map(|i| {
            Series::line(format!("a method with a long name, number {i}"), [[0.0, f64::from(i)], [1.0, 3.0]])
        })
        .collect();
    let svg = Graph { series, ..Graph::default() }.svg();
    let window = svg.split("<svg ").nth(2).unwrap();
    let top: f64 = window.split("y=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap();
    let entries: Vec<[f64; 2]> = svg
        .lines()
        .filter(|line| line.contains("a method with"))
        .map(|line| [1, 3].map(|part| line.split('"').nth(part).unwrap().parse().unwrap()))
        .collect();
    assert_eq!(entries.len(), 9);
    for [x, y] in entries {
        assert!(y < top, "an entry at {y} reaches into the data below {top}");
        assert!(x + 200.0 < 900.0, "an entry at {x} runs out of the picture");
    }
}

#[test]
fn a_path_of_100_000_targets_makes_a_picture_that_a_browser_opens() {
    let points: Vec<[f64; 2]> = (0..100_000)
        .map(|i| {
            let (line, step) = (i / 500, i % 500);
            [f64::from(if line % 2 == 0 { step } else { 499 - step }), f64::from(line)]
        })
        .collect();
    let values: Vec<f64> = (0..100_000).map(|i| (f64::from(i) / 300.0).sin().abs()).collect();
    let path = PlanPath { name: "raster".into(), points, values: values.clone() };
    let plan = PlanView { paths: vec![path], ..PlanView::default() }.svg();
    let strip =
        HeatStrip { strips: vec![Strip { name: "LTLM".into(), values }], ..HeatStrip::default() }.svg();
    assert_sound(&plan);
    assert!(plan.len() < 1_500_000 && strip.len() < 60_000, "{} and {} bytes", plan.len(), strip.len());
}

#[test]
fn a_curve_that_runs_as_another_is_named_and_not_drawn_over_it() {
    let line = |name: &str, first: f64, rest: f64| {
        let points: Vec<[f64; 2]> =
            (0..20).map(|k| [f64::from(k), if k == 0 { first } else { rest * f64::from(k) }]).collect();
        Series::line(name, points)
    };
    let all = || vec![line("before", 0.0, 0.1), line("kept", 0.5, 0.1001), line("after", 0.0, 0.01)];
    let names = |series: &[Series]| series.iter().map(|s| s.name.clone()).collect::<Vec<_>>();
    // Point 0 is on the way to the cut.
    let (drawn, alike) = distinguishable(all(), |x| x > 0.0);
    assert_eq!(names(&drawn), ["before", "after"]);
    assert_eq!(alike, [("kept".to_owned(), "before".to_owned())]);
    assert_eq!(distinguishable(all(), |_| true).0.len(), 3);
    let mut banded = all();
    banded[1] = banded[1].clone().plus_minus(&[0.1; 20]);
    assert_eq!(distinguishable(banded, |x| x > 0.0).0.len(), 3, "its band is to be seen");
}
