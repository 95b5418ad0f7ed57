//! Fanuc style programs.

use super::{Maker, Manner};

const VARIABLES: [u32; 3] = [100, 101, 102];

pub fn program(m: &mut Maker, head: &str) -> Vec<String> {
    let mut out = vec!["%".to_owned(), "O0001 (TEST)".to_owned()];
    out.extend(head.lines().map(str::to_owned));
    for line in ["#100=2.5", "#101=5.", "#102=10.", "G90 G21 G17 G40 G94", "T1 M6", "G54", "G43.4 H1"] {
        out.push(line.to_owned());
    }
    out.push(full(m, "G0"));
    out.extend(m.body(block));
    out.push("M30".to_owned());
    for name in [100, 200] {
        m.inch = false;
        out.push(format!("O0{name}"));
        m.loops = 1;
        for _ in 0..m.whole(1, 4) as i32 {
            out.extend(block(m, 1).into_iter().filter(|line| !line.contains("M98") && !line.contains("G65")));
        }
        out.push("M99".to_owned());
    }
    out.push("%".to_owned());
    out
}

fn full(m: &mut Maker, word: &str) -> String {
    let six = m.six();
    let feed = m.pick(&["F600.", "F1200.", "F600."]);
    format!("{word} {six} {feed}")
}

fn formula(m: &mut Maker, letter: &str) -> String {
    let text = m.pick(&[
        "#101",
        "[#101+5.]",
        "-#102",
        "#102",
        "[#100*2.]",
        "[#102-#100/2.]",
        "[SIN[30.]*#102]",
        "#149",
    ]);
    format!("{letter}{text}")
}

fn part(m: &mut Maker) -> String {
    let some = m.some(formula);
    let word = m.pick(&["", "", "G1 ", "G0 "]);
    format!("{word}{some}")
}

fn restate(m: &mut Maker) -> String {
    m.inch = false;
    let frame = m.pick(&["G54", "G55", "G54"]);
    let full = full(m, "G1");
    format!("G90 G21 G17 G40 {frame} G43.4 H1 {full}")
}

fn arc(m: &mut Maker) -> Vec<String> {
    let round = m.round();
    let (begin, mut block) = round.words(m);
    let kind = m.whole(0, 9);
    if kind == 0.0 {
        // A whole circle.
        block.truncate(block.len() - 2);
    }
    if (1.0..=3.0).contains(&kind) {
        block.push(m.axis("R", round.radius()));
    } else {
        for side in 0..2 {
            block.push(m.axis(["I", "J", "K"][round.axes[side]], round.centre[side]));
        }
    }
    if kind == 4.0 {
        block.push(round.rise(m));
    }
    round.blocks(begin, &block)
}

fn change(m: &mut Maker) -> Vec<String> {
    let one = |line: String| vec![line];
    match m.whole(0, 27) as i32 {
        0 | 1 => one("G91".into()),
        2 | 3 => one("G90".into()),
        4 => {
            m.inch = true;
            one("G20".into())
        }
        5 => {
            m.inch = false;
            one("G21".into())
        }
        6 | 7 => one(m.pick(&["G54", "G55", "G56", "G57", "G54.1 P2"]).into()),
        8 if m.features.presets => {
            let (x, more) = (m.whole(-2, 4) * 5.0, m.pick(&["", " Y5."]));
            let x = m.axis("X", x);
            one(format!("G92 {x}{more}"))
        }
        9 if m.features.presets => one(m.pick(&["G92.1", "G92 X0. Y0. Z0.", "G92.1 X0. Y0. Z0."]).into()),
        8 | 9 => one("G90".into()),
        10 => {
            let (x, z) = (m.pick(&[0.0, 10.0, -5.0]), m.pick(&[0.0, 5.0]));
            let (x, z) = (m.axis("X", x), m.axis("Z", z));
            one(format!("G52 {x} {z}"))
        }
        11 => {
            let number = m.pick(&[1, 2]);
            one(format!("G10 L2 P{number} X[#5221+{}] Y0. Z[#5223+5.]", m.pick(&["0.", "5."])))
        }
        12 => one(format!("T{} M6", m.pick(&[1, 2, 3]))),
        13 => one(m.pick(&["G43.4 H1", "G43.4 H2", "G43 H1", "G49", "G43.4 H3"]).into()),
        14 => vec![format!("G68 X0. Y0. R{}.", m.pick(&[10, 30])), part(m), "G69".into()],
        15 => vec!["G51.1 X0.".into(), part(m), "G50.1 X0.".into()],
        16 => {
            let value = m.whole(-2, 5) * 2.5;
            one(format!("#{}={value:.1}", m.pick(&VARIABLES)))
        }
        17 => one(format!("#{}=#{}+5.", m.pick(&[101, 102]), m.pick(&[100, 101]))),
        18 => one(m.pick(&["G53 Z0.", "G28 Z0.", "G28 X0. Y0.", "G30 Z0."]).into()),
        19 => vec![format!("G41 D1 {}", part(m)), format!("G40 {}", part(m))],
        20 => one(m.pick(&["#5223=#5223+5.", "#5242=#5242-10."]).into()),
        21 => one(m.pick(&["G18", "G19", "G17"]).into()),
        22 => one(format!("M98 P{}{}", m.pick(&[100, 200]), m.pick(&["", "", " L2"]))),
        23 => one(format!("G65 P{} A{}.", m.pick(&[100, 200]), m.pick(&[1, 5]))),
        24 => one(m.pick(&["M8", "M9", "M3 S2000", "G4 P500", "G4 X1.", "M1", "S900", "G64"]).into()),
        25 => {
            let p = m.place();
            let (x, y) = (m.axis("X", p[0]), m.axis("Y", p[1]));
            vec![format!("G81 {x} {y} Z-5. R2. F100."), m.pick(&["G80", "G0 G80"]).into()]
        }
        26 => one(format!("G1 X{} (NO POINT)", m.whole(-20, 20))),
        _ => one(format!("/{}", part(m))),
    }
}

const MANNER: Manner = Manner {
    changes: 0.72,
    change,
    flow,
    full: |m| {
        let word = m.pick(&["G1", "G0", "G1"]);
        full(m, word)
    },
    part,
    arc,
    restate: |m| vec![restate(m)],
};

fn block(m: &mut Maker, depth: u32) -> Vec<String> {
    m.block(&MANNER, depth)
}

fn flow(m: &mut Maker, kind: f64, depth: u32) -> Vec<String> {
    if kind < 0.82 {
        let label = m.label() + 1000;
        let mut out = vec![format!(
            "IF [#{} {} {}.] GOTO {label}",
            m.pick(&[100, 101]),
            m.pick(&["GT", "LE", "NE"]),
            m.pick(&[0, 5])
        )];
        for _ in 0..2 {
            out.extend(block(m, depth + 1));
        }
        out.push(format!("N{label} {}", part(m)));
        return out;
    }
    if kind < 0.86 {
        return vec![format!("IF [#{} LT 6.] THEN #101={}.", m.pick(&VARIABLES), m.pick(&[5, 10])), part(m)];
    }
    if kind < 0.94 && m.loops < 3 {
        m.loops += 1;
        let counter = 102 + m.loops;
        let level = m.loops;
        let mut out = vec![
            format!("#{counter}=0"),
            format!("WHILE [#{counter} LT {}] DO{level}", m.pick(&[0, 1, 2, 3])),
        ];
        for _ in 0..2 {
            out.extend(block(m, depth + 1));
        }
        out.push(format!("#{counter}=#{counter}+1"));
        out.push(format!("END{level}"));
        m.loops -= 1;
        return out;
    }
    vec![restate(m)]
}
