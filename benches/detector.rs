fn main() {
    use vsonar::detector::{CompiledDetector, Detector};
    let individual = vsonar::tree::Individual::load("examples/fmrb.gp").unwrap();
    let t = std::time::Instant::now();
    let d = CompiledDetector::compile_individual(&individual, 320, 240).unwrap();
    println!("compile {:?}", t.elapsed());
    let data = vsonar::world::default_dataset(1);
    println!("{}x{}", data.width(), data.height());
    let image = &data.images()[0].pixels;
    let columns: Vec<u32> = (0..12).map(|i| 13 + i * 26).collect();
    let mut rows = vec![0.0; 12];
    let mut best = f64::MAX;
    for _ in 0..2000 {
        let t = std::time::Instant::now();
        d.detect(image, &columns, &mut rows).unwrap();
        best = best.min(t.elapsed().as_secs_f64());
    }
    println!("{:.1} us {rows:?}", best * 1e6);
}
