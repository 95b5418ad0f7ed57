//! The picture of a measurement file.
