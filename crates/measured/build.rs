//! Tells the tests, when they are compiled, whether there are measured data: a test without its data is then shown as ignored.

fn main() {
    println!("cargo::rustc-check-cfg=cfg(measured_data)");
    println!("cargo::rerun-if-env-changed=TRUEGRIND_DATA");
    if std::env::var_os("TRUEGRIND_DATA").is_some() {
        println!("cargo::rustc-cfg=measured_data");
    }
}
