#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| truegrind_fuzz::arm_file(bytes));
