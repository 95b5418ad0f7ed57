//! A thousand corrected executions of each language, a fixed share of what the example runs.

use truegrind_differential::outcome::Dialect;
use truegrind_differential::rapid::Features;
use truegrind_differential::report;

#[test]
fn a_thousand_corrected_executions_of_each_language_agree() {
    for (dialect, tally, _) in report::many(&Dialect::ALL, 0, 1000 * Dialect::ALL.len(), Features::ALL) {
        let found: Vec<String> = tally.disagreements.iter().map(ToString::to_string).collect();
        assert!(found.is_empty(), "{}: {} wrong:\n{}", dialect.name(), found.len(), found.join("\n"));
        assert!(tally.corrected >= 1000, "{}: {} corrected", dialect.name(), tally.corrected);
    }
}
