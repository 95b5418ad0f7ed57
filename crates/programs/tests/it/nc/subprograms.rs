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
        task.listing.external_calls.iter().map(|&call| motions[call as usize].place.line).collect()
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
