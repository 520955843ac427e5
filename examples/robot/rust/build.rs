//! Links `libdetector.a` out of the folder that the environment variable DETECTOR_DIR names.

use std::path::Path;

fn main() {
    println!("cargo:rerun-if-env-changed=DETECTOR_DIR");
    let Ok(folder) = std::env::var("DETECTOR_DIR") else {
        panic!("set DETECTOR_DIR to the folder that `vsonar export --name detector` has written");
    };
    let Ok(folder) = Path::new(&folder).canonicalize() else {
        panic!("DETECTOR_DIR: there is no folder {folder}; it is taken from this package's folder on if it is not absolute");
    };
    let library = folder.join("libdetector.a");
    assert!(library.is_file(), "there is no {}: export with `--name detector`", library.display());
    println!("cargo:rerun-if-changed={}", library.display());
    println!("cargo:rustc-link-search=native={}", folder.display());
    println!("cargo:rustc-link-lib=static=detector");
}
