//! The cases of `tests/cases/*.toml` and `tests/regressions/*.toml`: each runs on every executor.

mod common;

use std::collections::BTreeMap;
use std::path::Path;

use image::{GrayImage, Luma};
use serde::Deserialize;
use vsonar::tree::Individual;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    images: BTreeMap<String, ImageSpec>,
    case: Vec<Case>,
}

/// A flat image with rectangles `[x, y, width, height, value]` painted on it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ImageSpec {
    size: [u32; 2],
    fill: u8,
    #[serde(default)]
    rects: Vec<[u32; 5]>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    name: String,
    program: String,
    image: String,
    column: u32,
    /// A binary32, `nan`, `inf`, or a fraction that is divided in binary32.
    answer: String,
}

impl ImageSpec {
    fn paint(&self) -> GrayImage {
        let mut image = GrayImage::from_pixel(self.size[0], self.size[1], Luma([self.fill]));
        for &[x0, y0, width, height, value] in &self.rects {
            for y in y0..y0 + height {
                for x in x0..x0 + width {
                    image.put_pixel(x, y, Luma([value as u8]));
                }
            }
        }
        image
    }
}

fn expected(answer: &str) -> f32 {
    let number = |text: &str| text.parse::<f32>().unwrap_or_else(|_| panic!("{text} is no number"));
    match answer.split_once('/') {
        Some((sum, area)) => number(sum) / number(area),
        None => number(answer),
    }
}

fn run_folder(folder: &str) -> usize {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(folder);
    let mut count = 0;
    let mut paths: Vec<_> = std::fs::read_dir(&folder)
        .unwrap_or_else(|e| panic!("{}: {e}", folder.display()))
        .map(|entry| entry.expect("the folder can be read").path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    paths.sort();
    let executors = common::executors();
    let mut faults = Vec::new();
    for path in paths {
        let text = std::fs::read_to_string(&path).expect("the file can be read");
        let file: File = toml::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        for case in &file.case {
            let image = file.images.get(&case.image).unwrap_or_else(|| panic!("no image {}", case.image));
            let individual: Individual =
                case.program.parse().unwrap_or_else(|e| panic!("{}: {e}", case.name));
            let cases = common::case_set(&[image.paint()], &[(0, case.column)]);
            for executor in &executors {
                count += 1;
                let found = common::answers(executor.as_ref(), &individual, &cases)[0];
                let expected = expected(&case.answer);
                if !common::same(found, expected) {
                    faults.push(format!(
                        "{} on {}: {found:?} instead of {expected:?} ({})",
                        case.name,
                        executor.name(),
                        path.display()
                    ));
                }
            }
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    count
}

#[test]
fn every_case_on_every_executor() {
    assert!(run_folder("cases") >= 600);
}

#[test]
fn every_regression_on_every_executor() {
    run_folder("regressions");
}
