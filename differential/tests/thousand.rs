//! A thousand corrected executions of each language, a fixed share of what the example runs.

use truegrind_differential::outcome::Dialect;
use truegrind_differential::rapid::Features;
use truegrind_differential::report;

#[test]
fn a_thousand_corrected_executions_of_each_language_agree() {
    let mut wrong = Vec::new();
    for (dialect, tally, _) in report::many(&Dialect::ALL, 0, 1000 * Dialect::ALL.len(), Features::ALL) {
        println!("{}", report::line(dialect.name(), &tally, 0.0));
        assert!(tally.corrected >= 1000, "{}: {} corrected", dialect.name(), tally.corrected);
        wrong.extend(tally.disagreements.iter().map(ToString::to_string));
    }
    assert!(wrong.is_empty(), "{} wrong:\n{}", wrong.len(), wrong.join("\n"));
}
