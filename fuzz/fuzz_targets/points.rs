#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| truegrind_fuzz::points(bytes));
