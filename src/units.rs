//! Many inputs over several machines: which unit belongs to which share, by what a unit is known, and what is kept of one that
//! is done.
//!
//! A *unit* is what one run handles by itself: the files of one task, or the measurements of one arm. It is idempotent: its key
//! covers all that decides what comes of it, its outputs get their names when they are whole, and its record comes after them.
//! Whatever starts the jobs (Slurm, Kubernetes, HTCondor, GNU parallel, Dask, Ray) has nothing to do but try again.

pub mod done;
pub mod key;
pub mod run;
pub mod share;
