//! Statistics of scores: what a sample of runs says, and how far two samples differ.
//!
//! Everything here is a pure function; what draws at random does so from a seed, so results repeat on any machine.
//!
//! ```
//! use vsonar::statistics::{Quartiles, a12, holm, rank_sum};
//!
//! // Test scores of eight seeds with each of two settings.
//! let (new, old) = ([91, 88, 95, 90, 93, 89, 94, 92], [85, 90, 80, 87, 84, 86, 83, 82]);
//! let (new, old) = (new.map(f64::from), old.map(f64::from));
//! assert_eq!(Quartiles::of(&new).map(|q| q.median), Some(91.5));
//! // A run of the new settings beats one of the old with this probability (ties count half).
//! assert_eq!(a12(&new, &old).map(|a| a.0), Some(61.5 / 64.0));
//! // So large a difference of ranks is no chance.
//! let p = rank_sum(&new, &old).expect("neither is empty");
//! assert!(p < 0.01);
//! // Of two comparisons made, the smaller p value counts double.
//! assert_eq!(holm(&[p, 0.4]), [2.0 * p, 0.4]);
//! ```

mod bootstrap;
mod effect;
mod holm;
mod quartiles;
mod rank_sum;

pub use bootstrap::{Cluster, interval};
pub use effect::{A12, Magnitude, a12};
pub use holm::holm;
pub use quartiles::{Quartiles, quantile};
pub use rank_sum::rank_sum;
