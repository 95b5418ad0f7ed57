//! Runs over many inputs on several machines: shares, keys and records of units.
//!
//! A *unit* is processed independently: the files of one task, or the measurements of one arm. Units are idempotent: the key covers
//! everything that determines the result, outputs are renamed into place when complete, and the record is written after them. A
//! scheduler (Slurm, Kubernetes, HTCondor, GNU parallel, Dask, Ray) only has to retry.

pub mod done;
pub mod key;
pub mod run;
pub mod share;
