//! A file that is only a subprogram: its initial state is that of its caller.

use truegrind_programs::motion::Reason::{self, *};
use truegrind_programs::nc::Task;
use truegrind_programs::nc::setup::Setup;

use super::default_deny::HEAD;

fn reasons(name: &str, body: &str) -> Vec<Option<Reason>> {
    let source = format!("{HEAD}{body}\n");
    let task = Task::read(&[(name, source.as_bytes())], &Setup::default());
    task.listing.motions.iter().map(|motion| motion.reason()).collect()
}

#[test]
fn the_state_of_the_caller_is_unknown() {
    let flow = Some(UnknownFlow);
    let go = "G1 X10. Y0. Z50. A180. B0. C90. F500.\nX20. Y0. Z50. A180. B0. C90.";
    assert_eq!(reasons("a.nc", &format!("O1000\nG43.4 H1\n{go}\nM99")), [flow, flow]);
    assert_eq!(reasons("a.ngc", &format!("o<part> sub\n{go}\no<part> endsub")), [flow, flow]);
    assert_eq!(reasons("a.ngc", &format!("{go}\nM99")), [flow, flow]);
    let siemens = "T1 D1\nTRAORI\nG1 X300 Y0 Z300 A=180 B=0 C=90 F500";
    for (name, head, end) in [
        ("a.mpf", "PROC OP1", "M17"),
        ("a.mpf", "", "RET"),
        ("a.SPF", "", "M30"),
        ("a.mpf", "%_N_OP1_SPF", "M30"),
    ] {
        assert_eq!(reasons(name, &format!("{head}\n{siemens}\n{end}")), [flow], "{name} {head} {end}");
    }
    // Stating part of the state is not stating all of it: coordinates may be mirrored, rotated, scaled.
    assert_eq!(
        reasons("a.nc", &format!("O1000\nG90 G21 G17 G40 G54\nT1 M6\nG43.4 H1\n{go}\nM99")),
        [flow, flow]
    );
}

#[test]
fn a_main_program_with_subprograms_starts_in_the_power_on_state() {
    let go = "G43.4 H1\nG1 X10. Y0. Z50. A180. B0. C90. F500.";
    assert_eq!(reasons("a.nc", &format!("O1\nT1 M6\n{go}\nM98 P2\nM30\nO2\nG1 X5.\nM99"))[0], None);
    assert_eq!(reasons("a.nc", &format!("O1\nT1 M6\n{go}\n/M99\nM30"))[0], None);
    let ngc = "G90 G21 G54\nG1 X10 Y0 Z50 A180 B0 C90 F500\no<part> call\nM2";
    assert_eq!(reasons("a.ngc", &format!("o<part> sub\nG1 X5\no<part> endsub\n{ngc}"))[1], None);
    assert_eq!(reasons("a.mpf", "TRAORI\nT1 D1\nG54\nG1 X300 Y0 Z300 A=180 B=0 C=90 F500\nM30"), [None]);
}

#[test]
fn calls_of_programs_outside_the_file_are_listed() {
    let outside = |name: &str, body: &str| -> Vec<u32> {
        let task = Task::read(&[(name, body.as_bytes())], &Setup::default());
        let motions = &task.listing.motions;
        task.listing.nc.external_calls.iter().map(|&call| motions[call as usize].place.line).collect()
    };
    let go = "G1 X1. Y2. Z3. A180. B0. C0. F600.";
    let fanuc = format!("O1\nM98 P2\nM98 P30002\nM98 P9\nG65 P9010 A1.\n{go}\nM30\nO2\nX5.\nM99\n");
    assert_eq!(outside("a.nc", &fanuc), [4, 5]);
    let linux = format!(
        "o<in> sub\nG1 X5\no<in> endsub\no10 sub\no10 endsub\no<IN> call [1]\no10 call\no<out> call\n{go}\nM2\n"
    );
    assert_eq!(outside("a.ngc", &linux), [8]);
    let siemens =
        format!("TRAORI\n{go}\nSUB1\nCALL \"SUB2\"\nL10\nAGAIN:\nX5\nDONE:\nREPEAT AGAIN DONE\nM30\n");
    assert_eq!(outside("a.mpf", &siemens), [3, 4, 5]);
    let klartext = "0 BEGIN PGM A MM\n1 CALL LBL 1\n2 CALL PGM B.H\n3 CYCL DEF 12.0 PGM CALL\n4 CYCL DEF 12.1 PGM C.H\n5 CYCL CALL\n6 LBL 1\n7 LBL 0\n8 END PGM A MM\n";
    assert_eq!(outside("a.h", klartext), [3, 6]);
    assert_eq!(outside("a.h", &klartext.replace("5 CYCL CALL", "5 L X+5 M99")), [3, 6]);
}

/// The words of a macro are executed where its name stands: it is no program that may be assumed to change nothing.
#[test]
fn a_macro_is_no_program_outside_the_file() {
    let go = "G1 X1 Y2 Z3 A=180 B=0 C=0 F600";
    for macro_ in ["DEFINE UP AS TRANS Z50", "N5 define Up as G91 G1 X5"] {
        let body = format!("{HEAD}{macro_}\nTRAORI\nT1 D1\nG54\n{go}\nUP\n{go}\nM30\n");
        let task = Task::read(&[("a.mpf", body.as_bytes())], &Setup::default());
        assert!(task.listing.nc.external_calls.is_empty(), "{macro_}");
        let found: Vec<Option<Reason>> = task.listing.motions.iter().map(|motion| motion.reason()).collect();
        assert_eq!(found, [None, Some(Reason::UnknownWord), Some(Reason::UnknownWord)], "{macro_}");
    }
}

/// What a block lacks behind ENDIF, a label or a loop is told word by word.
#[test]
fn the_words_that_are_missing_behind_a_label_are_named() {
    let head = "TRAORI\nT1 D1\nG90 G71 G54\nG1 X1 Y2 Z3 A=180 B=0 C=0 F600\n";
    let lacks = |between: &str, block: &str| -> Option<String> {
        let text = format!("{HEAD}{head}{between}\n{block}\nM30\n");
        let listing = Task::read(&[("a.mpf", text.as_bytes())], &Setup::default()).listing;
        let last = listing.motions.len() as u32 - 1;
        assert_eq!(
            listing.motions[last as usize].reason() == Some(Reason::UnknownFlow),
            listing.nc.unstated.contains_key(&last)
        );
        listing.nc.unstated.get(&last).cloned()
    };
    let branch = |block: &str| format!("IF R1==1\n{block}\nENDIF");
    let whole = "G1 X4 Y5 Z6 A=180 B=0 C=0";
    assert_eq!(lacks(&branch("G1 X9 A=170"), whole), None);
    assert_eq!(lacks(&branch("G1 A=170"), "G1 X4 Y5 Z6").as_deref(), Some("A, B, C"));
    assert_eq!(lacks(&branch("G1 X9 Z8"), "G1 Y5 A=180 B=0 C=0").as_deref(), Some("X, Z"));
    assert_eq!(lacks(&branch("G91"), whole).as_deref(), Some("G90"));
    assert_eq!(lacks(&branch("G55"), whole).as_deref(), Some("the work offset (G54)"));
    assert_eq!(lacks(&branch("G0 X9"), "X4 Y5 Z6 A=180 B=0 C=0").as_deref(), Some("a motion word (G0, G1)"));
    let label = lacks("AGAIN:\nG1 X5\nG91\nIF R1==1 GOTOB AGAIN", whole).unwrap_or_default();
    assert!(label.contains("G90") || label.is_empty(), "{label}");
}

/// Motions that may follow each other across calls, returns, jumps and loops, as pairs of lines.
#[test]
fn motions_follow_each_other_across_calls() {
    let pairs = |files: &[(&str, &str)]| -> Vec<[u32; 2]> {
        let go = "G1 X1. Y2. Z3. A180. B0. C0. F600.\n";
        let klartext = "L X+1 Y+2 Z+3 F600\n";
        let expand =
            |name: &str, text: &str| text.replace("GO\n", if name.ends_with(".h") { klartext } else { go });
        let texts: Vec<(&str, String)> =
            files.iter().map(|(name, text)| (*name, expand(name, text))).collect();
        let files: Vec<(&str, &[u8])> = texts.iter().map(|(name, text)| (*name, text.as_bytes())).collect();
        let task = Task::read(&files, &Setup::default());
        let line = |motion: u32| {
            let place = task.listing.motions[motion as usize].place;
            place.file * 100 + place.line
        };
        task.listing.across_calls.iter().map(|pair| pair.map(line)).collect()
    };
    let one = |name: &str, text: &str| pairs(&[(name, text)]);
    assert!(one("a.nc", "O1\nGO\nGO\nM30\n").is_empty());
    // Lines 2 and 4 of the main program, 7 and 8 of the subprogram, called twice in the second.
    assert_eq!(one("a.nc", "O1\nGO\nM98 P2\nGO\nM30\nO2\nGO\nGO\nM99\n"), [[2, 7], [8, 4]]);
    assert_eq!(
        one("a.nc", "O1\nGO\nM98 P20002\nM98 P2\nGO\nM30\nO2\nGO\nGO\nM99\n"),
        [[2, 8], [9, 5], [9, 8]]
    );
    // A call that may be skipped, and a return that may be.
    assert_eq!(one("a.nc", "O1\nGO\n/M98 P2\nGO\nM30\nO2\nGO\nGO\nM99\n"), [[2, 4], [2, 7], [8, 4]]);
    assert_eq!(one("a.nc", "O1\nGO\nM98 P2\nGO\nM30\nO2\nGO\n/M99\nGO\nM99\n"), [[2, 7], [7, 4], [9, 4]]);
    // A subprogram without motions, and one of no file, which may have none.
    assert_eq!(one("a.nc", "O1\nGO\nM98 P2\nGO\nM98 P2\nGO\nM30\nO2\nM8\nM99\n"), [[2, 4], [4, 6]]);
    assert_eq!(one("a.nc", "O1\nGO\nM98 P9\nGO\nM30\n"), [[2, 4]]);
    // Through one that only calls.
    assert_eq!(
        one("a.nc", "O1\nGO\nM98 P2\nGO\nM30\nO2\nM98 P3\nM99\nO3\nGO\nGO\nM99\n"),
        [[2, 10], [11, 4]]
    );
    // A loop, a jump back, and a main program that starts again.
    assert!(one("a.nc", "O1\nWHILE[#1LT3]DO1\nGO\nM8\nGO\nEND1\nGO\nM30\n").contains(&[5, 3]));
    assert!(one("a.nc", "O1\nN10\nGO\nGO\nIF[#1LT3]GOTO10\nGO\nM30\n").contains(&[4, 3]));
    assert!(one("a.nc", "O1\nGO\nM97 P10\nGO\nM30\nN10 GO\nGO\nM99\n").contains(&[7, 4]));
    assert!(one("a.mpf", "AGAIN:\nGO\nGO\nDONE:\nREPEAT AGAIN DONE\nGO\nM30\n").contains(&[3, 2]));
    assert_eq!(one("a.nc", "O1\nGO\nM8\nGO\nM99\n"), [[4, 2]]);
    // Subprograms of LinuxCNC, which the main program bypasses, and labels of Klartext, which it passes.
    assert_eq!(
        one("a.ngc", "GO\no<in> sub\nGO\nGO\no<in> endsub\nGO\no<in> call\nGO\nM2\n"),
        [[1, 6], [4, 8], [6, 3]]
    );
    assert_eq!(
        one("a.h", "BEGIN PGM A MM\nGO\nLBL 1\nGO\nGO\nLBL 0\nGO\nCALL LBL 1\nGO\nEND PGM A MM\n"),
        [[5, 9], [7, 4]]
    );
    // Other files of the same run.
    let called = ("SUB1.SPF", "GO\nGO\nM17\n");
    assert_eq!(pairs(&[("a.mpf", "GO\nSUB1\nGO\nM30\n"), called]), [[1, 101], [102, 3]]);
    assert_eq!(pairs(&[called, ("a.mpf", "GO\nCALL \"SUB1\"\nGO\nM30\n")]), [[2, 103], [101, 1]]);
    assert_eq!(
        pairs(&[
            ("a.h", "BEGIN PGM A MM\nGO\nCALL PGM B.H\nGO\nEND PGM A MM\n"),
            ("b.h", "BEGIN PGM B MM\nGO\nEND PGM B MM\n")
        ]),
        [[2, 102], [102, 4]]
    );
}
