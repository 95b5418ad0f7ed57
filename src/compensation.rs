//! compensation
