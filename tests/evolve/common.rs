//! What the tests of runs share: a small data set, small settings, the executors.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use image::{GrayImage, Luma};
use vsonar::dataset::{Case, Dataset, NamedImage};
use vsonar::evolve::{Evolution, RunFolder, Settings, State, StopReason};
use vsonar::exec::Executor;
use vsonar::exec::batch::BatchExecutor;
use vsonar::exec::cranelift::{CraneliftExecutor, Shape};
use vsonar::exec::reference::ReferenceExecutor;
use vsonar::exec::tree::TreeExecutor;

pub(crate) const WIDTH: u32 = 64;
pub(crate) const HEIGHT: u32 = 48;

/// A tiny world: textured floor below a wall whose foot is at a row that varies with image and column.
pub(crate) fn dataset_with(salt: u32) -> Dataset {
    let mut images = Vec::new();
    let mut cases = Vec::new();
    for i in 0..6u32 {
        let foot = |x: u32| 6 + (7 * i + salt + x / (4 + i)) % 36;
        let pixels = GrayImage::from_fn(WIDTH, HEIGHT, |x, y| {
            let grain = (x * 31 + y * 17 + i * 7 + (x * y) % 13) % 23;
            Luma([if y > foot(x) { 90 + grain as u8 } else { 200 - (y / 4) as u8 }])
        });
        images.push(NamedImage { name: format!("frame_{i}.png"), pixels });
        cases.extend([8, 20, 33, 51].map(|x| Case { image: i as usize, x, y: foot(x) }));
    }
    Dataset::new("tiny", images, cases).expect("a sound set")
}

pub(crate) fn dataset() -> Dataset {
    dataset_with(0)
}

/// Small enough for the walker: the published method with plain columns, the filter and shared fitness. Here in full, so
/// that it stays what it is whatever the presets become.
pub(crate) fn settings() -> Settings {
    let text = "preset = \"paper\"\npopulation = 60\ngenerations = 5\ntolerance = 3.0\n\
                [creation]\nmin_depth = 2\nmax_depth = 4\nplain_column_probability = 0.7\n\
                [selection]\nkind = \"sharing\"\n[filter]\nenabled = true\nmax_draws = 30\n";
    Settings::from_toml(text, "test").expect("sound settings")
}

/// The executor of tests that are about something else.
pub(crate) fn reference() -> Arc<dyn Executor> {
    Arc::new(ReferenceExecutor)
}

/// All executors. The walker does not lower, so with it no result is known from a cache of programs.
pub(crate) fn executors() -> Vec<Arc<dyn Executor>> {
    let compiled = |shape| -> Arc<dyn Executor> {
        Arc::new(CraneliftExecutor::new(shape).expect("this machine has a code generator"))
    };
    let batch = Arc::new(BatchExecutor::widest());
    vec![reference(), Arc::new(TreeExecutor), compiled(Shape::Scalar), compiled(Shape::Lanes4), batch]
}

pub(crate) fn never() -> AtomicBool {
    AtomicBool::new(false)
}

/// Runs to the end in a fresh folder and gives the last state.
pub(crate) fn run_in(path: &Path, settings: &Settings, executor: Arc<dyn Executor>, threads: usize) -> State {
    let folder = RunFolder::create(path, settings, &toml::Table::new()).expect("a fresh folder");
    let mut run =
        Evolution::in_folder(folder, &dataset(), settings.clone(), executor, threads).expect("a run");
    assert_eq!(run.run(&never(), |_| ()).expect("no error"), StopReason::Finished);
    run.state().expect("a state").clone()
}

/// How many programs were run for each generation.
pub(crate) fn executed(state: &State) -> Vec<u64> {
    state.records.iter().map(|record| record.timing.executed).collect()
}

/// Goes on with the run of a folder.
pub(crate) fn resume(path: &Path) -> Evolution {
    let (folder, settings) = RunFolder::open(path).expect("a run folder");
    Evolution::in_folder(folder, &dataset(), settings, reference(), 2).expect("a run")
}

/// The text of a file of the run folder.
pub(crate) fn read(path: &Path, name: &str) -> String {
    std::fs::read_to_string(path.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The log without its timing.
pub(crate) fn log(path: &Path) -> Vec<serde_json::Value> {
    let without_timing = |line: &str| {
        let mut value: serde_json::Value = serde_json::from_str(line).expect("a line is JSON");
        assert!(value.as_object_mut().expect("an object").remove("timing").is_some());
        value
    };
    read(path, "log.jsonl").lines().map(without_timing).collect()
}

/// Everything a run folder says, but for the timing.
pub(crate) fn content(path: &Path) -> (Vec<serde_json::Value>, String, String) {
    (log(path), read(path, "best.gp"), read(path, "hall_of_fame.jsonl"))
}
