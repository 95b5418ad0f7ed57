//! Mathematical basis: rigid motions, numerical derivatives, statistics, SIMD kernels, parts of sentences, TOML texts, digests, cancellable work.

pub mod lanes;
pub mod gram;
pub mod axpy;
pub mod se3;
pub mod difference;
pub mod statistics;
pub mod sentence;
pub mod toml_text;
pub mod distribution;
pub mod tail;
pub mod radial;
pub mod rounding;
pub mod spectral;
pub mod option_f64;
pub mod work;
pub mod digest;
