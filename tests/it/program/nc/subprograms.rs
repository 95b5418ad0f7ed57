//! A file that is only a subprogram: what holds at its begin is its caller's.

use truegrind::program::motion::Reason::{self, *};
use truegrind::program::nc::Task;
use truegrind::program::nc::setup::Setup;

use super::certain::HEAD;

fn reasons(name: &str, body: &str) -> Vec<Option<Reason>> {
    let source = format!("{HEAD}{body}\n");
    let task = Task::read(&[(name, source.as_bytes())], &Setup::default());
    task.listing.motions.iter().map(|motion| motion.reason()).collect()
}

#[test]
fn what_the_caller_has_set_is_not_known() {
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
    // Stating some of it is not stating all: it may be mirrored, turned, scaled.
    assert_eq!(
        reasons("a.nc", &format!("O1000\nG90 G21 G17 G40 G54\nT1 M6\nG43.4 H1\n{go}\nM99")),
        [flow, flow]
    );
}

#[test]
fn a_main_program_with_subprograms_of_its_own_begins_as_it_did() {
    let go = "G43.4 H1\nG1 X10. Y0. Z50. A180. B0. C90. F500.";
    assert_eq!(reasons("a.nc", &format!("O1\nT1 M6\n{go}\nM98 P2\nM30\nO2\nG1 X5.\nM99"))[0], None);
    assert_eq!(reasons("a.nc", &format!("O1\nT1 M6\n{go}\n/M99\nM30"))[0], None);
    let ngc = "G90 G21 G54\nG1 X10 Y0 Z50 A180 B0 C90 F500\no<part> call\nM2";
    assert_eq!(reasons("a.ngc", &format!("o<part> sub\nG1 X5\no<part> endsub\n{ngc}"))[1], None);
    assert_eq!(reasons("a.mpf", "TRAORI\nT1 D1\nG54\nG1 X300 Y0 Z300 A=180 B=0 C=90 F500\nM30"), [None]);
}
