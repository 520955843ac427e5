//! How often each line of a listing counts, on data.

use std::collections::BTreeMap;

use serde::Serialize;

use super::evaluate::{Observer, Position};
use super::listing::{Listing, Site};
use super::print::Line;
use crate::dataset::Dataset;
use crate::evolve::is_correct;
use crate::statistics::Quartiles;

/// Characters of a condition in a margin, at most.
const CONDITION: usize = 40;

/// What happened when a listing ran on a data set.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Profile {
    /// The data set's name.
    pub data: String,
    /// How many cases it has.
    pub cases: usize,
    /// How many answers were correct.
    pub correct: usize,
    /// Within so many rows of the label.
    pub tolerance: f64,
    /// Height of the images in pixels.
    pub height: u32,
    /// The sweeps that are there, in the order they run.
    pub sweeps: Vec<SweepProfile>,
}

/// One sweep.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SweepProfile {
    /// Positions in all cases together.
    pub positions: u64,
    /// Cases in which a `stop` ended it.
    pub stopped: u64,
    /// The places that are counted, by their numbers.
    pub sites: Vec<SiteProfile>,
}

/// A choice, an assignment or a `stop`.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct SiteProfile {
    /// How often the condition held, or the statement was come to.
    pub held: u64,
    /// How often the condition did not hold.
    pub not: u64,
    /// The number of the position, counted from 1, at which a `stop` fired.
    pub stops_at: Option<Quartiles>,
}

impl SiteProfile {
    /// The share of the times come to in which the condition held; `None` if it never was.
    pub fn share(&self) -> Option<f64> {
        let all = self.held + self.not;
        (all > 0).then(|| self.held as f64 / all as f64)
    }
}

/// Counts.
#[derive(Debug, Default)]
struct Counter {
    sweeps: Vec<SweepProfile>,
    /// What was come to at this position.
    here: Vec<Site>,
    /// Positions of the sweep so far in this case.
    step: u64,
    /// For each sweep and place, at which positions it was come to when the sweep stopped.
    stops: Vec<Vec<Vec<f64>>>,
}

impl Observer for Counter {
    fn site(&mut self, sweep: usize, site: Site, held: bool) {
        let sites = &mut self.sweeps[sweep].sites;
        if sites.len() <= site as usize {
            sites.resize(site as usize + 1, SiteProfile::default());
        }
        let site_profile = &mut sites[site as usize];
        if held {
            site_profile.held += 1;
        } else {
            site_profile.not += 1;
        }
        self.here.push(site);
    }

    fn position(&mut self, sweep: usize, at: &Position) {
        self.sweeps[sweep].positions += 1;
        self.step += 1;
        if at.stopped {
            self.sweeps[sweep].stopped += 1;
            for &site in &self.here {
                let stops = &mut self.stops[sweep];
                if stops.len() <= site as usize {
                    stops.resize(site as usize + 1, Vec::new());
                }
                stops[site as usize].push(self.step as f64);
            }
            self.step = 0;
        }
        self.here.clear();
    }
}

impl Profile {
    /// Runs a listing on all cases of a set; an answer is correct within `tolerance` rows.
    pub fn of(listing: &Listing, set: &Dataset, tolerance: f64) -> Profile {
        let sweeps = listing.sweeps().count();
        let mut counter = Counter {
            sweeps: vec![SweepProfile::default(); sweeps],
            stops: vec![Vec::new(); sweeps],
            ..Counter::default()
        };
        let cases = set.case_set();
        let mut correct = 0;
        for (i, case) in set.cases().iter().enumerate() {
            let mut watched = OneCase { counter: &mut counter, sweep: 0 };
            let outcome = listing.run(cases.image(i), case.x as f32, &mut watched);
            counter.step = 0;
            correct += usize::from(is_correct(outcome.answer(), f64::from(case.y), tolerance));
        }
        let Counter { mut sweeps, stops, .. } = counter;
        for (number, (profile, sweep)) in sweeps.iter_mut().zip(listing.sweeps()).enumerate() {
            let count = sweep.clone().number_sites() as usize;
            profile.sites.resize(count, SiteProfile::default());
            for site in sweep.stop_sites() {
                let at = stops[number].get(site as usize).map_or(&[][..], Vec::as_slice);
                profile.sites[site as usize].stops_at = Quartiles::of(at);
            }
        }
        let (data, cases) = (set.name().to_string(), set.cases().len());
        Profile { data, cases, correct, tolerance, height: set.height(), sweeps }
    }

    /// What stands in the margin of each line: of a choice the share of times in which its condition held and in which
    /// not, of a `stop` in how many cases it fired. Empty where nothing is counted.
    pub fn margins(&self, listing: &Listing) -> Vec<String> {
        let sweeps: Vec<(Vec<Site>, BTreeMap<Site, String>)> =
            listing.sweeps().map(|sweep| (sweep.stop_sites(), sweep.conditions())).collect();
        let margin = |line: &Line| {
            let number = line.sweep?;
            let (stops, conditions) = sweeps.get(number)?;
            Some(self.margin(number, line, stops, conditions))
        };
        listing.lines().iter().map(|line| margin(line).unwrap_or_default()).collect()
    }

    fn margin(
        &self,
        number: usize,
        line: &Line,
        stops: &[Site],
        conditions: &BTreeMap<Site, String>,
    ) -> String {
        let of = |site: &Site| &self.sweeps[number].sites[*site as usize];
        let is_stop = |site: &Site| stops.binary_search(site).is_ok();
        let mut parts = Vec::new();
        let mut here = line.sites.iter().filter(|site| conditions.contains_key(site));
        if let Some(site) = here.next() {
            parts.push(match of(site).share() {
                Some(share) => format!("{:>6} | {:>6}", percent(share), percent(1.0 - share)),
                None => "never come to".to_string(),
            });
            // Choices inside of what the line computes, by their conditions.
            parts.extend(here.map(|site| {
                let share = of(site).share().map_or_else(|| "never come to".to_string(), percent);
                format!("{}: {share}", cut(conditions.get(site).map_or("", String::as_str)))
            }));
        } else if let [site] = line.sites[..]
            && !is_stop(&site)
        {
            parts.push(format!("{} ×", of(&site).held));
        }
        if let Some(site) = line.sites.iter().find(|site| is_stop(site)) {
            let at = of(site).stops_at.map_or(String::new(), |q| match (q.lower, q.upper) {
                (lower, upper) if lower == upper => format!(", mostly at position {lower:.0}"),
                (lower, upper) => format!(", mostly at position {lower:.0} to {upper:.0}"),
            });
            parts.push(format!("stops {} of {} cases{at}", of(site).held, self.cases));
        }
        parts.join("   ")
    }
}

/// A condition as it fits beside a line.
fn cut(condition: &str) -> String {
    match condition.chars().count() {
        n if n > CONDITION => condition.chars().take(CONDITION - 1).chain(['…']).collect(),
        _ => condition.to_string(),
    }
}

/// The counter in one case: a sweep that ends by itself begins the next one's count.
struct OneCase<'a> {
    counter: &'a mut Counter,
    sweep: usize,
}

impl Observer for OneCase<'_> {
    fn site(&mut self, sweep: usize, site: Site, held: bool) {
        self.counter.site(sweep, site, held);
    }

    fn position(&mut self, sweep: usize, at: &Position) {
        if sweep != self.sweep {
            (self.sweep, self.counter.step) = (sweep, 0);
        }
        self.counter.position(sweep, at);
    }
}

/// A share as a percentage; what is neither none nor all is not shown as such.
pub(super) fn percent(share: f64) -> String {
    match 100.0 * share {
        p if p > 0.0 && p < 0.1 => "<0.1 %".to_string(),
        p if p < 100.0 && p > 99.9 => ">99.9 %".to_string(),
        p => format!("{p:.1} %"),
    }
}

#[cfg(test)]
mod tests {
    use image::{GrayImage, Luma};

    use super::*;
    use crate::dataset::{Case, NamedImage};

    /// Two images of 16 x 16 pixels: the first is 10 everywhere, the second 200 above row 8.
    fn set() -> Dataset {
        let one = GrayImage::from_pixel(16, 16, Luma([10]));
        let two = GrayImage::from_fn(16, 16, |_, y| Luma([if y < 8 { 200 } else { 10 }]));
        let named = |name: &str, pixels| NamedImage { name: name.to_string(), pixels };
        let cases = vec![
            Case { image: 0, x: 4, y: 0 },
            Case { image: 1, x: 4, y: 7 },
            Case { image: 1, x: 9, y: 15 },
        ];
        Dataset::new("hand", vec![named("one", one), named("two", two)], cases).expect("sound")
    }

    #[test]
    fn counts_by_hand() {
        // A window of 2 x 2 centred on row y covers rows y and y + 1, and visits rows 14 to 0.
        let text = "images of 16 x 16 pixels\n\n\
            the tree: a 2 x 2 window moves up column x-obstacle\n    \
            if raw > 100:\n        a := y\n        stop\n    \
            else if y < 2: b := if b > 0 then 5 else 7\n\nanswer: a\n";
        let listing: Listing = text.parse().expect("a listing");
        let profile = Profile::of(&listing, &set(), 1.0);
        let [sweep] = &profile.sweeps[..] else { panic!("{profile:?}") };
        // The first case visits all 15 rows. In the second image row 7 is half bright (average 105), after rows 14 to 8:
        // position 8, in both columns.
        assert_eq!((sweep.positions, sweep.stopped), (15 + 8 + 8, 2));
        let counts: Vec<(u64, u64)> = sweep.sites.iter().map(|site| (site.held, site.not)).collect();
        // raw > 100, a :=, stop, y < 2, b :=, b > 0
        assert_eq!(counts, [(2, 15 + 7 + 7), (2, 0), (2, 0), (2, 13 + 7 + 7), (2, 0), (1, 1)]);
        let at = sweep.sites[2].stops_at.expect("it fired");
        assert_eq!((at.min, at.lower, at.median, at.upper, at.max), (8.0, 8.0, 8.0, 8.0, 8.0));
        // Answers 0, 7 and 7.
        assert_eq!((profile.correct, profile.cases), (2, 3));
        let margins = profile.margins(&listing);
        let margin = |i: usize| &margins[i];
        assert_eq!(margin(3), " 6.5 % | 93.5 %");
        assert_eq!(margin(4), "2 ×");
        assert_eq!(margin(5), "stops 2 of 3 cases, mostly at position 8");
        assert_eq!(margin(6), " 6.9 % | 93.1 %   b > 0: 50.0 %");
    }

    #[test]
    fn shares_do_not_round_to_all_or_none() {
        assert_eq!(
            [0.0, 1e-6, 0.5, 0.99999, 1.0].map(percent),
            ["0.0 %", "<0.1 %", "50.0 %", ">99.9 %", "100.0 %"]
        );
    }
}
