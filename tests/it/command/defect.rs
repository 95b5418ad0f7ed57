//! A panic is an error of the unit that it happens in.

use rayon::prelude::*;

#[allow(dead_code, reason = "the hook belongs to the program")]
#[path = "../../../src/cli/defect.rs"]
mod caught;

#[test]
fn a_panic_ends_one_unit_and_not_the_others() {
    let units: Vec<anyhow::Result<usize>> = (0..100usize)
        .into_par_iter()
        .map(|unit| {
            caught::catch_panic(|| {
                // Across threads too.
                let parts: Vec<usize> = (0..10usize)
                    .into_par_iter()
                    .map(
                        |part| if (unit, part) == (42, 7) { panic!("unit {unit} is at fault") } else { part },
                    )
                    .collect();
                Ok(parts.len())
            })
        })
        .collect();
    for (unit, done) in units.iter().enumerate() {
        match done {
            Ok(parts) => assert!(*parts == 10 && unit != 42),
            Err(error) => {
                let text = format!("{error:#}");
                assert!(
                    unit == 42
                        && text.contains("internal error of truegrind")
                        && text.contains("unit 42 is at fault"),
                    "{text}"
                );
            }
        }
    }
    assert!(units[42].is_err());
}

#[test]
fn errors_pass_as_they_are() {
    let done: anyhow::Result<()> = caught::catch_panic(|| anyhow::bail!("row 3: no number"));
    assert_eq!(done.unwrap_err().to_string(), "row 3: no number");
}
