//! What holds at labels, loops, branches and in subprograms: what all paths that lead there agree on.

use truegrind_programs::motion::Reason::{self, *};
use truegrind_programs::nc::Task;
use truegrind_programs::nc::called::called_programs;
use truegrind_programs::nc::dialect::Dialect::{self, *};
use truegrind_programs::nc::setup::Setup;

use super::default_deny::{HEAD, begin};

/// The reasons of the motions in the lines that end in a comment `?`: `None` where the motion would be changed.
fn marked(dialect: Dialect, source: &str) -> Vec<Option<Reason>> {
    let setup = Setup { dialect: Some(dialect), ..Setup::default() };
    let task = Task::read(&[("x", source.as_bytes())], &setup);
    let lines: Vec<&str> = source.lines().collect();
    let is_marked = |line: u32| lines[line as usize - 1].contains('?');
    let motions = task.listing.motions.iter().filter(|motion| is_marked(motion.place.line));
    motions.map(|motion| motion.reason()).collect()
}

fn check(dialect: Dialect, body: &str, expected: &[Option<Reason>]) {
    let source = format!("{HEAD}{}{body}\n", begin(dialect));
    assert_eq!(marked(dialect, &source), expected, "{dialect:?}: {body}");
}

const FLOW: Option<Reason> = Some(UnknownFlow);
/// A motion that states everything but what its modal groups mean.
const H: &str = "L X+5 Y+5 Z+5 A+180 B+0 C+0 F500 ;?";
const G: &str = "G1 X5. Y5. Z5. A180. B0. C0. F500. (?)";
const S: &str = "G1 X5 Y5 Z5 A=180 B=0 C=0 F500 ;?";

#[test]
fn a_label_that_is_called_has_the_states_of_its_calls() {
    // What follows the program end is not on the way to the label.
    let sub = |body: &str| format!("CALL LBL 1\n{H}\nM30\nLBL 1\n{H}\n{body}\nLBL 0\nM129");
    check(Heidenhain, &sub(""), &[None, None]);
    check(Heidenhain, &sub("M129"), &[Some(NoTcpMode), None]);
    // Most programs of that control end with a stop.
    for end in ["STOP M30", "STOP M2", "M2"] {
        let ended = format!("CALL LBL 1\nM129\n{end}\nLBL 1\n{H}\nLBL 0");
        check(Heidenhain, &ended, &[None]);
    }
    check(Heidenhain, &format!("CALL LBL 1\nM129\nSTOP M5\nLBL 1\n{H}\nLBL 0"), &[FLOW]);
    check(Heidenhain, &sub("FN 9: IF +Q1 EQU +0 GOTO LBL 2\nM129\nLBL 2"), &[FLOW, None]);
    // Called with two tools, or in another mode.
    let twice = |between: &str| format!("CALL LBL 1\n{between}\nCALL LBL 1\nM30\nLBL 1\n{H}\nLBL 0");
    check(Heidenhain, &twice(""), &[None]);
    check(Heidenhain, &twice("TOOL CALL 2 Z S1000"), &[FLOW]);
    check(Heidenhain, &twice("TOOL CALL 1 Z S900"), &[None]);
    // It is called by the label that it calls.
    check(Heidenhain, &format!("CALL LBL 1\nM30\nLBL 1\n{H}\nM129\nCALL LBL 1\nLBL 0"), &[FLOW]);
}

#[test]
fn a_subprogram_has_the_states_of_its_calls() {
    let sub =
        |calls: &str, body: &str| format!("{calls}\n{G}\nM30\nO100\n{G}\n{body}\nM99\nO200\nG91 G1 X5.\nM99");
    check(Fanuc, &sub("M98 P100", ""), &[None, None]);
    check(Fanuc, &sub("M98 P100", "G55"), &[None, None]);
    check(Fanuc, &sub("M98 P100 L2", "G55"), &[None, FLOW]);
    check(Fanuc, &sub("M98 P20100", "G55"), &[None, FLOW]);
    check(Fanuc, &sub("M98 P100", "M98 P200"), &[FLOW, None]);
    check(Fanuc, &sub("M98 P100\nM98 P200\nM98 P100", ""), &[FLOW, FLOW]);
    // Any program may be called, in any state; or the block at which the call begins is named.
    check(Fanuc, &sub("G55\nM98 P100\nG54\nM98 P#1", ""), &[FLOW, FLOW]);
    let linux = |call: &str, body: &str| format!("o1 sub\n{G}\n{body}\no1 endsub\n{call}\n{G}\nM2");
    check(LinuxCnc, &linux("o1 call", ""), &[None, None]);
    check(LinuxCnc, &linux("G55\no1 call\nG54", "G54"), &[None, None]);
    check(LinuxCnc, &linux("o1 call\nG55\no1 call", ""), &[FLOW, FLOW]);
    check(LinuxCnc, &linux("o1 call", "o2 if [#1 gt 1]\no1 return\no2 endif\nG55"), &[None, FLOW]);
}

#[test]
fn a_loop_has_the_states_before_it_and_at_its_end() {
    let last = "G55";
    for (dialect, head, end, motion) in [
        (LinuxCnc, "o1 while [#1 lt 5]", "o1 endwhile", G),
        (LinuxCnc, "o1 repeat [5]", "o1 endrepeat", G),
        (LinuxCnc, "o1 do", "o1 while [#1 lt 5]", G),
        (Fanuc, "WHILE [#1 LT 5] DO1", "END1", G),
        (Fanuc, "N10 G4 X1.", "IF [#1 LT 5] GOTO 10", G),
        (Siemens, "FOR R1 = 1 TO 5", "ENDFOR", S),
        (Siemens, "WHILE R1 < 5", "ENDWHILE", S),
        (Siemens, "REPEAT", "UNTIL R1 > 5", S),
        (Siemens, "AGAIN: G4 F1", "IF R1 < 5 GOTOB AGAIN", S),
        (Siemens, "AGAIN: G4 F1", "REPEAT AGAIN P=3", S),
    ] {
        check(dialect, &format!("{head}\n{motion}\n{end}\n{motion}\n{last}"), &[None, None]);
        check(dialect, &format!("{head}\n{motion}\n{last}\n{end}\nG54\n{motion}"), &[FLOW, None]);
        let behind = format!("{head}\n{last}\n{motion}\nG54\n{end}\n{motion}\nG56");
        check(dialect, &behind, &[None, None]);
    }
    let body = format!("LBL 7\n{H}\nL IX+3 ;\nCALL LBL 7 REP 3\n{H}");
    check(Heidenhain, &format!("{body}\nM129"), &[None, None]);
    check(Heidenhain, &body.replace("L IX+3", "M129"), &[FLOW, Some(NoTcpMode)]);
    check(Siemens, &format!("LOOP\n{S}\nIF R1 > 5 GOTOF DONE\nENDLOOP\nDONE: G4 F1\n{S}"), &[None, None]);
    let early =
        format!("o1 while [#1 lt 5]\nG55\no2 if [#2 gt 1]\no1 break\no2 endif\nG54\no1 endwhile\n{G}");
    check(LinuxCnc, &early, &[FLOW]);
    check(LinuxCnc, &early.replace("break", "continue"), &[FLOW]);
}

#[test]
fn behind_branches_holds_what_they_agree_on() {
    let linux = |one: &str, other: &str| format!("o1 if [#1 gt 1]\n{one}\no1 else\n{other}\no1 endif\n{G}");
    check(LinuxCnc, &linux("G55", "G55"), &[None]);
    check(LinuxCnc, &linux("G55", ""), &[FLOW]);
    check(LinuxCnc, &linux("G55", "G56"), &[FLOW]);
    let three = format!("o1 if [#1 gt 1]\nG55\no1 elseif [#1 gt 0]\nG55\no1 else\nG55\no1 endif\n{G}");
    check(LinuxCnc, &three, &[None]);
    check(LinuxCnc, &three.replace("o1 else\nG55\n", ""), &[FLOW]);
    let siemens = |one: &str, other: &str| format!("IF R1 > 1\n{one}\nELSE\n{other}\nENDIF\n{S}");
    check(Siemens, &siemens("G55", "G55"), &[None]);
    check(Siemens, &siemens("G55", ""), &[FLOW]);
    check(Siemens, &siemens("GOTOF DONE", "G55").replace("ENDIF", "ENDIF\nDONE: G4 F1"), &[FLOW]);
    check(Siemens, &siemens("G4 F1", "").replace("ELSE\n", ""), &[None]);
    // A jump over what the label states again.
    check(Fanuc, &format!("IF [#1 GT 1] GOTO 10\nG55\nN10 G55\n{G}"), &[None]);
    check(Fanuc, &format!("IF [#1 GT 1] GOTO 10\nG55\nN10 G4 X1.\n{G}"), &[FLOW]);
    // What no path reaches counts, in case it is reached after all.
    check(Fanuc, &format!("GOTO 10\nG55\nN10 G4 X1.\n{G}"), &[FLOW]);
    check(Fanuc, &format!("/GOTO 10\nG55\nN10 G4 X1.\n{G}"), &[FLOW]);
    let tool = "TOOL CALL 0 Z S1000\nM128";
    let over = format!("FN 9: IF +Q1 EQU +0 GOTO LBL 3\n{tool}\nLBL 3\n");
    check(Heidenhain, &format!("{over}{tool}\n{H}"), &[None]);
    check(Heidenhain, &format!("{over}{H}"), &[FLOW]);
    let parts = format!(
        "CASE R1 OF 1 GOTOF ONE 2 GOTOF TWO DEFAULT GOTOF DONE\nONE: G54\nTWO: G55\nDONE: G4 F1\n{S}"
    );
    check(Siemens, &parts, &[FLOW]);
    check(Siemens, &parts.replace("G4 F1", "G54"), &[None]);
}

#[test]
fn a_jump_or_call_that_may_lead_anywhere_leaves_what_the_whole_file_sets_to_one_value() {
    for (open, dialect, motion) in [
        ("GOTO #2", Fanuc, G),
        ("M99 P#1", Fanuc, G),
        ("M97 P10", Fanuc, G),
        ("IF [#1 GT 1] GOTO 77", Fanuc, G),
        ("GOTOF \"N\"<<R1", Siemens, S),
        ("GOTOF NOWHERE", Siemens, S),
        ("GOTOS", Siemens, S),
        ("REPEAT DONE AGAIN", Siemens, S),
        ("ENDLABEL: G4 F1\nREPEAT AGAIN P=2", Siemens, S),
        ("EXECSTRING(\"GOTOF DONE\")", Siemens, S),
        ("ENDIF", Siemens, S),
        ("WHENEVER $A_IN[1]==1 DO M8", Siemens, S),
        ("CALL LBL QS1", Heidenhain, H),
        ("FN 9: IF +Q1 EQU +0 GOTO LBL QS1", Heidenhain, H),
    ] {
        let label = match dialect {
            Heidenhain => "LBL 3",
            Siemens => "DONE: G4 F1",
            _ => "N10 G4 X1.\nIF [#1 GT 9] GOTO 10",
        };
        let change = if dialect == Heidenhain { "M129" } else { "G55" };
        let again = if dialect == Siemens { "AGAIN: G4 F1\n" } else { "" };
        check(dialect, &format!("{again}{open}\n{label}\n{motion}\n{change}"), &[FLOW]);
    }
}

#[test]
fn programs_of_other_files_may_call_the_programs_of_a_file_in_any_state() {
    let setup = Setup { dialect: Some(Fanuc), ..Setup::default() };
    let last = |files: &[(&str, &[u8])]| {
        let listing = Task::read(files, &setup).listing;
        listing.motions.iter().rfind(|motion| motion.place.file == 0).map(|motion| motion.reason())
    };
    let file = format!("{HEAD}O1\n{}M98 P2\nG55\nM30\nO2\n{G}\nM99\n", begin(Fanuc));
    assert_eq!(last(&[("a", file.as_bytes())]), Some(None));
    assert_eq!(last(&[("a", file.as_bytes()), ("b", b"G91 G55\nM98 P2\nM30\n")]), Some(FLOW));
    // A subprogram that calls itself is first called by another file.
    let own = format!("{HEAD}o<part> sub\n{G}\n{}G55\no<part> call\no<part> endsub\n", begin(LinuxCnc));
    assert_eq!(marked(LinuxCnc, &own), [FLOW]);
}

#[test]
fn an_exact_stop_that_may_be_skipped_is_none() {
    let stops = |block: &str| {
        let source = format!("{HEAD}{}{block}\n{G}\n", begin(LinuxCnc));
        let setup = Setup { dialect: Some(LinuxCnc), ..Setup::default() };
        Task::read(&[("x", source.as_bytes())], &setup).listing.motions[1].zone.is_some()
    };
    assert!(stops("G61"));
    assert!(!stops("/G61"));
    assert!(!stops("o1 if [#1 gt 1]\nG61\no1 endif"));
    assert!(!stops("G61\n/G64"));
}

#[test]
fn variables_hold_where_all_paths_agree_on_them() {
    let go = "G1 X#1 Y5. Z5. A180. B0. C0. F500. (?)";
    check(Fanuc, &format!("#1=5.\nWHILE [#2 LT 5] DO1\n#2=#2+1\n{go}\nEND1\n{go}"), &[None, None]);
    check(Fanuc, &format!("#1=5.\nWHILE [#1 LT 5] DO1\n{go}\n#1=#1+1\nEND1\n{go}"), &[FLOW, FLOW]);
    check(Fanuc, &format!("#1=5.\nM98 P2\n{go}\nM30\nO2\n{go}\nM99"), &[FLOW, FLOW]);
}

/// The end of each is the start of the next.
#[test]
fn many_calls_in_a_row_are_no_levels() {
    let calls: String = (0..50).map(|k| format!("M98 P{}\n", 100 + k)).collect();
    let subs =
        |last: &str| -> String { (0..50).map(|k| format!("O{}\n{G}\n{last}M99\n", 100 + k)).collect() };
    let source = |last: &str| format!("{HEAD}O1\n{}{calls}{G}\nG55\nM30\n{}", begin(Fanuc), subs(last));
    assert_eq!(marked(Fanuc, &source("")), [None; 51]);
    // The first one runs before any has selected G55.
    let found = marked(Fanuc, &source("G55\n"));
    assert_eq!(found[1], None);
    assert!(found.iter().all(|reason| matches!(*reason, None | FLOW)));
}

/// Each call is followed by another: more levels than passes. The rule for the whole file holds then.
#[test]
fn many_levels_of_calls_end() {
    let mut source = format!("{HEAD}{}CALL LBL 1\n{H}\nM30\n", begin(Heidenhain));
    for label in 1..60 {
        source += &format!("LBL {label}\n{H}\nCALL LBL {}\nLBL 0\n", label + 1);
    }
    source += &format!("LBL 60\n{H}\nLBL 0\n");
    assert!(marked(Heidenhain, &source).iter().all(Option::is_none));
}

/// The motions before each marked one: that before it in the text, or those where paths have met.
fn starts(dialect: Dialect, body: &str) -> Vec<Vec<u32>> {
    let source = format!("{HEAD}{}{body}\n", begin(dialect));
    let setup = Setup { dialect: Some(dialect), ..Setup::default() };
    let task = Task::read(&[("x", source.as_bytes())], &setup);
    let lines: Vec<&str> = source.lines().collect();
    let motions = task.listing.motions.iter().enumerate();
    motions
        .filter(|(_, motion)| lines[motion.place.line as usize - 1].contains('?'))
        .map(|(index, motion)| match motion.previous {
            Some(previous) => vec![previous],
            None => task.listing.predecessors.get(&(index as u32)).cloned().unwrap_or_default(),
        })
        .collect()
}

/// A line behind a branch begins where the motions before it end, so that its path can be checked.
#[test]
fn a_motion_knows_where_it_may_begin() {
    // The first motion has index 0.
    assert_eq!(starts(LinuxCnc, &format!("o1 if [#1 EQ 1]\nM8\no1 endif\n{G}")), [[0]]);
    assert_eq!(starts(LinuxCnc, &format!("o1 if [#1 EQ 1]\nG1 X9\no1 endif\n{G}")), [vec![0, 1]]);
    assert_eq!(starts(Siemens, &format!("M_1:\n{S}")), [[0]]);
    assert_eq!(starts(Siemens, &format!("M_1:\n{S}\nG1 X7\nIF R1==1 GOTOB M_1")), [vec![0, 2]]);
    assert_eq!(starts(Fanuc, &format!("IF [#1 EQ 1] GOTO 10\nG1 X9.\nN10 {G}")), [vec![0, 1]]);
    // Behind a call, and in what is called.
    let called = format!("CALL LBL 1\n{H}\nM30\nLBL 1\n{H}\nLBL 0");
    assert_eq!(starts(Heidenhain, &called), [[3], [0]]);
    // A motion to a place that the text does not tell, and a program in another file.
    assert_eq!(starts(LinuxCnc, &format!("G28 X0\no1 if [#1 EQ 1]\nM8\no1 endif\n{G}")), [[0_u32; 0]]);
    assert_eq!(starts(Fanuc, &format!("M98 P7000\n{G}")), [[0_u32; 0]]);
}

/// CALL LBL 1 REP 2 in the middle of a feed path is no stop: what stands before and behind it is one cut.
#[test]
fn a_path_goes_on_behind_a_repetition() {
    let body = format!("LBL 1\n{H}\nL X+9\nCALL LBL 1 REP 2\n{H}");
    let source = format!("{HEAD}{}{body}\n", begin(Heidenhain));
    let task =
        Task::read(&[("x", source.as_bytes())], &Setup { dialect: Some(Heidenhain), ..Setup::default() });
    let across = &task.listing.across_calls;
    assert!(across.contains(&[2, 4]) && across.contains(&[2, 1]), "{across:?}");
}

/// Some controls of that kind execute what stands behind a condition.
#[test]
fn words_behind_a_condition_may_do_anything() {
    for words in ["THEN G55", "THEN G91", "G55", "THEN G1 Z5."] {
        check(Fanuc, &format!("IF [#1 EQ 1] {words}\n{G}"), &[Some(UnknownWord)]);
    }
    check(Fanuc, &format!("IF [#1 EQ 1] THEN #2=3\n{G}"), &[None]);
}

/// Every program of Heidenhain begins alike: that another calls it shows there alone.
#[test]
fn a_program_that_another_calls_begins_in_the_state_of_the_caller() {
    let caller =
        b"1 CYCL DEF 7.1 Z+100\n2 CALL PGM TNC:\\parts\\Sub.h ; CALL PGM NONE\n3 CYCL DEF 12.1 PGM two.h\n";
    assert_eq!(called_programs(caller), ["SUB", "TWO"]);
    assert_eq!(
        called_programs(b"EXTCALL \"/_N_SPF_DIR/_N_ONE_SPF\"\nN10 CALL \"two.mpf\"\nCALLS=1\n"),
        ["ONE", "TWO"]
    );
    let source = format!("{HEAD}{}{H}\n", begin(Heidenhain));
    let read = |called: &[&str]| {
        let called = called.iter().map(|name| (*name).to_owned()).collect();
        let setup = Setup { dialect: Some(Heidenhain), called, ..Setup::default() };
        let task = Task::read(&[("sub.h", source.as_bytes())], &setup);
        task.listing.motions.iter().map(|motion| motion.reason()).collect::<Vec<_>>()
    };
    assert_eq!(read(&["TWO"]), [None, None]);
    assert!(read(&["SUB"]).iter().all(Option::is_some));
    // Its own TOOL CALL says which tool that is.
    let setup = Setup { dialect: Some(Heidenhain), called: ["SUB".to_owned()].into(), ..Setup::default() };
    let task = Task::read(&[("sub.h", source.as_bytes())], &setup);
    let tool = task.listing.tool(&task.listing.motions[0]);
    assert_eq!(tool.map(|tool| tool.name.as_str()), Some("T1"));
}
