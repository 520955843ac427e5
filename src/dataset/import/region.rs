//! Parts of a picture: polygons, discs, runs of pixels. Each tells, for a column, the rows that it covers.
//!
//! Coordinates are continuous: pixel (x, y) covers `[x, x + 1) x [y, y + 1)`. A pixel belongs to a polygon or a disc if
//! its centre does. Inside a polygon is what an odd number of its edges lies above: where it crosses itself, the parts that
//! are enclosed twice are outside (the even-odd rule).

use super::Surface;
use super::rle::Runs;

/// A part of a picture.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// Polygons, the last corner of each joined to the first: what is inside any of them. Coordinates are finite.
    Polygons(Vec<Vec<[f64; 2]>>),
    /// A disc.
    Disc {
        /// Its centre.
        centre: [f64; 2],
        /// Its radius in pixels.
        radius: f64,
    },
    /// Single pixels, for a picture of a certain size.
    Runs(Runs),
    /// Single pixels within a rectangle, row by row.
    Pixels {
        /// Column and row of the upper left one, which may be outside the picture.
        corner: [i64; 2],
        /// Width of the rectangle, at least 1.
        width: u32,
        /// Whether each of them is in the region.
        inside: Vec<bool>,
    },
}

impl Region {
    /// Gives the surface to the pixels of column `x` that are in the region; `column` goes from the top down.
    pub fn paint(&self, x: u32, surface: Surface, column: &mut [Surface]) {
        let height = column.len();
        match self {
            Region::Polygons(polygons) => {
                for polygon in polygons {
                    let mut crossings = crossings(polygon, f64::from(x) + 0.5);
                    crossings.sort_by(f64::total_cmp);
                    for pair in crossings.chunks_exact(2) {
                        column[rows(pair[0], pair[1], height)].fill(surface);
                    }
                }
            }
            Region::Disc { centre: [cx, cy], radius } => {
                let aside = f64::from(x) + 0.5 - cx;
                let half = (radius * radius - aside * aside).sqrt();
                // NaN beside the disc.
                if half > 0.0 {
                    column[rows(cy - half, cy + half, height)].fill(surface);
                }
            }
            Region::Runs(runs) => runs.in_column(x, |rows| column[rows].fill(surface)),
            Region::Pixels { corner: [left, top], width, inside } => {
                let across = i64::from(x) - left;
                if !(0..i64::from(*width)).contains(&across) {
                    return;
                }
                for (row, line) in inside.chunks_exact(*width as usize).enumerate() {
                    let y = usize::try_from(top + row as i64).ok();
                    let pixel = y.and_then(|y| column.get_mut(y));
                    if let (Some(pixel), true) = (pixel, line[across as usize]) {
                        *pixel = surface;
                    }
                }
            }
        }
    }
}

/// Where the edges of a polygon cross a vertical line; an even number of times.
fn crossings(polygon: &[[f64; 2]], x: f64) -> Vec<f64> {
    let next = polygon.iter().cycle().skip(1);
    let crosses = |(&[x0, y0], &[x1, y1]): (&[f64; 2], &[f64; 2])| {
        // An edge has its left end but not its right one, so that a corner counts once, or twice, or not at all.
        ((x0 <= x) != (x1 <= x)).then(|| y0 + (x - x0) / (x1 - x0) * (y1 - y0))
    };
    polygon.iter().zip(next).filter_map(crosses).collect()
}

/// The rows whose middle is in `from .. to`.
fn rows(from: f64, to: f64, height: usize) -> std::ops::Range<usize> {
    // The conversion takes what is too large or too small to the nearest number there is.
    let first = |edge: f64| ((edge - 0.5).ceil() as usize).min(height);
    let (from, to) = (first(from), first(to));
    from..to.max(from)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The pixels of a region in a picture, as rows of text.
    fn drawn(region: &Region, width: u32, height: usize) -> Vec<String> {
        let columns: Vec<Vec<Surface>> = (0..width)
            .map(|x| {
                let mut column = vec![Surface::Other; height];
                region.paint(x, Surface::Ground, &mut column);
                column
            })
            .collect();
        let pixel = |column: &Vec<Surface>, y: usize| if column[y] == Surface::Ground { '#' } else { '.' };
        (0..height).map(|y| columns.iter().map(|column| pixel(column, y)).collect()).collect()
    }

    fn polygon(points: &[[f64; 2]]) -> Region {
        Region::Polygons(vec![points.to_vec()])
    }

    #[test]
    fn pixels_are_inside_if_their_centres_are() {
        let square = polygon(&[[1.0, 1.0], [4.0, 1.0], [4.0, 3.0], [1.0, 3.0]]);
        assert_eq!(drawn(&square, 5, 4), [".....", ".###.", ".###.", "....."]);
        // Edges through centres: left and upper ones count, so that neighbours share no pixel and leave none out.
        let half = polygon(&[[1.5, 1.5], [3.5, 1.5], [3.5, 2.5], [1.5, 2.5]]);
        assert_eq!(drawn(&half, 5, 4), [".....", ".##..", ".....", "....."]);
        let next = polygon(&[[3.5, 1.5], [3.5, 2.5], [4.5, 2.5], [4.5, 1.5]]);
        assert_eq!(drawn(&next, 5, 4), [".....", "...#.", ".....", "....."]);
        let triangle = polygon(&[[0.0, 0.0], [4.0, 4.0], [0.0, 4.0]]);
        assert_eq!(drawn(&triangle, 4, 4), ["#...", "##..", "###.", "####"]);
    }

    #[test]
    fn concave_and_crossing_polygons() {
        let hollow =
            [[0.0, 0.0], [3.0, 0.0], [3.0, 4.0], [2.0, 4.0], [2.0, 1.0], [1.0, 1.0], [1.0, 4.0], [0.0, 4.0]];
        assert_eq!(drawn(&polygon(&hollow), 3, 4), ["###", "#.#", "#.#", "#.#"]);
        // Twice around the same square is outside again; two polygons are inside either.
        let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        assert_eq!(drawn(&polygon(&[square, square].concat()), 2, 2), ["..", ".."]);
        let both = Region::Polygons(vec![square.to_vec(), square.to_vec()]);
        assert_eq!(drawn(&both, 2, 2), ["##", "##"]);
    }

    #[test]
    fn what_is_outside_the_picture_is_cut() {
        let large = polygon(&[[-1e300, -1e300], [1e300, -1e300], [1e300, 1e300], [-1e300, 1e300]]);
        assert_eq!(drawn(&large, 2, 2), ["##", "##"]);
        for away in [[5.0, 0.0], [-9.0, 0.0], [0.0, -9.0], [0.0, 9.0]] {
            let square =
                [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]].map(|[x, y]| [x + away[0], y + away[1]]);
            assert_eq!(drawn(&polygon(&square), 2, 2), ["..", ".."]);
        }
        assert_eq!(drawn(&polygon(&[]), 2, 2), ["..", ".."]);
        let extreme = polygon(&[[f64::MIN, f64::MAX], [f64::MAX, f64::MIN], [f64::MAX, f64::MAX]]);
        drawn(&extreme, 3, 3);
    }

    #[test]
    fn discs_and_pixels() {
        let disc = Region::Disc { centre: [2.5, 2.5], radius: 1.2 };
        assert_eq!(drawn(&disc, 5, 5), [".....", "..#..", ".###.", "..#..", "....."]);
        assert_eq!(drawn(&Region::Disc { centre: [2.5, 2.5], radius: 0.0 }, 3, 3), ["...", "...", "..."]);
        let inside = vec![true, false, true, true, true, false];
        let pixels = |corner| Region::Pixels { corner, width: 2, inside: inside.clone() };
        assert_eq!(drawn(&pixels([1, 0]), 3, 3), [".#.", ".##", ".#."]);
        assert_eq!(drawn(&pixels([-1, -1]), 3, 3), ["#..", "...", "..."]);
    }
}
