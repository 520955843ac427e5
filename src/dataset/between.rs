//! Cases between labelled columns: how a detector does where nobody looked, as far as neighbours tell.
//!
//! ```
//! use image::GrayImage;
//! use vsonar::dataset::{Case, Dataset, NamedImage};
//!
//! let image = NamedImage { name: "a.png".into(), pixels: GrayImage::new(64, 48) };
//! let case = |x, y| Case { image: 0, x, y };
//! let set = Dataset::new("one", vec![image], vec![case(10, 20), case(20, 24), case(30, 47)])?;
//! // 24 and 47 are too far apart to say anything of the columns between them.
//! let (between, neighbours) = set.between(0.5, 10.0).expect("one pair agrees");
//! assert_eq!((between.cases(), &neighbours[..]), (&[case(15, 22)][..], &[[0, 1]][..]));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

use super::{Case, Dataset};

impl Dataset {
    /// The set with other cases: one between each two neighbouring labelled columns of an image whose labels differ by
    /// no more than `tolerance` rows, at this fraction of the way from the left to the right one (0 to 1, rounded to a
    /// column); with each its two neighbours, as numbers of cases of this set. The label is interpolated. `None` if
    /// there is no such case.
    ///
    /// Such a label is a guess. It misses what is narrower than the distance of the columns, and the cases are easier
    /// than others, for their surroundings are even; a result on them is to be held against that on the neighbours.
    pub fn between(&self, fraction: f64, tolerance: f64) -> Option<(Dataset, Vec<[usize; 2]>)> {
        let mut order: Vec<usize> = (0..self.cases.len()).collect();
        order.sort_by_key(|&i| (self.cases[i].image, self.cases[i].x));
        let (mut cases, mut neighbours) = (Vec::new(), Vec::new());
        for pair in order.windows(2) {
            let [a, b] = [self.cases[pair[0]], self.cases[pair[1]]];
            let agree = f64::from(a.y.abs_diff(b.y)) <= tolerance;
            let x = interpolated(a.x, b.x, fraction);
            if a.image == b.image && agree && a.x < x && x < b.x {
                let way = f64::from(x - a.x) / f64::from(b.x - a.x);
                cases.push(Case { image: a.image, x, y: interpolated(a.y, b.y, way) });
                neighbours.push([pair[0], pair[1]]);
            }
        }
        let set = Dataset::new(self.name.clone(), self.images.clone(), cases).ok()?;
        Some((set, neighbours))
    }
}

fn interpolated(a: u32, b: u32, way: f64) -> u32 {
    (f64::from(a) + way * (f64::from(b) - f64::from(a))).round() as u32
}
