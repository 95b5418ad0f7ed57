//! Robot programs: lossless reading, interpretation as motions, rewriting by edits. Knows no robot.
//!
//! - [`tree`]: lossless syntax trees over bytes in flat arrays; parsing never fails.
//! - [`edit`]: sorted, disjoint edits; bytes outside them never change; [`diff`] prints them.
//! - [`motion`]: the motions of a program in any language, as a [`motion::Listing`].
//! - [`rewrite`]: changes to motions in any language, and their outcomes.
//! - `dataflow`: program analysis for every language: joins, fixpoints, the walk over statements.
//! - [`persistent_map`]: persistent maps with cheap copies and joins, for abstract states.
//! - [`draft`]: new programs, independent of the language.
//! - [`rapid`]: ABB's RAPID: front end, evaluation, rewriting, writing.
//! - [`nc`]: G-code of five-axis machines: the same.
//! - [`reading`]: detects the language of a program.
//!
//! ```
//! use truegrind_programs::motion::TargetValue;
//! use truegrind_programs::rapid::Task;
//! use truegrind_programs::rewrite::{Change, NewTarget, RewriteOptions};
//!
//! let source = b"MODULE M\nPROC main()\n  MoveL [[500,0,300],[0,0,1,0],[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]],v100,fine,tool0;\nENDPROC\nENDMODULE\n";
//! let task = Task::read(&[("main.mod", &source[..])]);
//! let motion = &task.listing.motions[0];
//! assert_eq!((motion.place.line, &*motion.instruction), (3, "MoveL"));
//! let Ok(TargetValue::Cartesian(target)) = motion.targets[0].value else { panic!() };
//!
//! let moved = NewTarget::Cartesian { position_mm: [500.25, 0.0, 300.0], quaternion: target.quaternion, conf: None };
//! let change = Change { motion: 0, targets: [moved].into(), before: vec![] };
//! let rewritten = task.rewrite(&[change], &RewriteOptions::default()).unwrap();
//! let text = rewritten.files[0].edits.apply(source).unwrap();
//! assert!(text.starts_with(b"MODULE M\nPROC main()\n  MoveL [[500.2500,0,300],[0,0,1,0]"));
//! ```

pub mod tree;
mod dataflow;
mod motion_set;
pub mod persistent_map;
pub mod edit;
pub mod label;
pub mod diff;
pub mod motion;
pub mod rewrite;
pub mod remainder;
pub mod draft;
pub mod rapid;
pub mod nc;
pub mod reading;
