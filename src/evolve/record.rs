//! What is recorded of a generation: a line of `log.jsonl`.

use serde::{Deserialize, Serialize};

use super::collapse::Collapse;
use super::diversity::{Diversity, HardestCase};
use super::fitness::share;
use super::population::{Genotype, Member};

/// A generation in numbers. All but [`Record::timing`] is the same on every machine, at any number of threads,
/// and with every executor.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Record {
    /// Number of the generation; the initial one is 0.
    pub generation: u32,
    /// Highest share of the training cases that a member of this generation solves. Training cases are those that
    /// selection sees: with augmentation the altered copies too.
    pub best_fitness: f64,
    /// Mean of it over the generation.
    pub mean_fitness: f64,
    /// Median of it over the generation.
    pub median_fitness: f64,
    /// Highest share of the cases solved in this or any earlier generation.
    pub best_fitness_so_far: f64,
    /// With augmentation: the share of the unaltered training cases that the generation's best member solves, which
    /// is the smallest of those of [`Record::best_fitness`]. Absent without, where it would be the same.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub best_fitness_unaltered: Option<f64>,
    /// With a validation part: the share of its cases that the program solves that was the run's winner after this
    /// generation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub validation_fitness: Option<f64>,
    /// Individuals evaluated for this generation: every draw of the initial one; later all but copies of
    /// parents. Results known from a cache count, so the number does not depend on the cache.
    pub evaluations: u64,
    /// Individuals evaluated so far, this generation included.
    pub evaluations_total: u64,
    /// Nodes of the generation's best member (the smallest of the best).
    pub best_nodes: u32,
    /// Nodes of a member, on average.
    pub mean_nodes: f64,
    /// Nodes of the largest member.
    pub max_nodes: u32,
    /// Depth of a member (of its deeper tree), on average; a root's is 0.
    pub mean_depth: f64,
    /// Depth of the deepest member.
    pub max_depth: u32,
    /// Members that differ as programs.
    pub distinct_programs: u32,
    /// Members that differ in some answer.
    pub distinct_behaviours: u32,
    /// Share of the members that answer the same to every case.
    pub constant_share: f64,
    /// Share of the members that answer as the most common behaviour does. This and the next three are absent from the
    /// records of releases that did not count them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_behaviour: Option<f64>,
    /// Entropy of the training cases solved, as a share of the largest possible: with n members that solve a case and
    /// p = n / sum of n over all cases, the sum of -p log2 p, divided by log2 of the number of cases. 1 if all cases are
    /// solved equally often, near 0 if the generation solves but a handful; 0 if it solves none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub case_entropy: Option<f64>,
    /// Training cases that no member of this generation solves; altered copies are not counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solved_by_nobody: Option<u32>,
    /// The training case that the fewest members solve; altered copies are not looked at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub hardest_case: Option<HardestCase>,
    /// How the run has collapsed; absent as long as it has not. See [`Warning`](super::Warning) for what to try.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub warning: Option<Collapse>,
    /// Live operations (instructions that are no leaves) of a program before the optimiser, on average over the
    /// individuals that were lowered for this generation: every draw of the initial one; later each offspring
    /// that equals neither a parent nor an earlier offspring. 0 if there is none; absent from the records of
    /// releases that did not count them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operations_before: Option<f64>,
    /// The same after the optimiser.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub operations_after: Option<f64>,
    /// How many different programs these individuals are after the optimiser (told apart by 128 bits of hash).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distinct_optimised: Option<u64>,
    /// Draws of the initial generation; absent from all others.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub initial: Option<InitialDraws>,
    /// Where the time went: the only part that differs from one run to the next.
    pub timing: GenerationTiming,
}

/// How the initial generation was drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct InitialDraws {
    /// Individuals drawn, rejected ones included.
    pub draws: u64,
    /// Slots that were filled with the last of the allowed draws, though it did not pass the filter.
    pub unfit_kept: u64,
}

/// Seconds spent on a generation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct GenerationTiming {
    /// Lowering and optimising, summed over the threads.
    pub lower: f64,
    /// Code generation, summed over the threads.
    pub compile: f64,
    /// Running programs on the cases, summed over the threads.
    pub execute: f64,
    /// Evaluation from the first draw or lowering to the last result, as the clock has it.
    #[serde(default)]
    pub evaluate: f64,
    /// Share of the threads' time of evaluation in which they were at work, 0 to 1.
    #[serde(default)]
    pub busy: f64,
    /// Selecting and breeding, as the clock has it.
    pub breed: f64,
    /// Statistics of the generation, as the clock has it.
    pub record: f64,
    /// Writing the run folder for the generation before this one, as the clock has it.
    pub save: f64,
    /// The whole generation, as the clock has it.
    pub wall: f64,
    /// Programs that were run; all other results were known. It is the same for any number of threads and all
    /// executors but `tree`, which knows no results; after a resume it is higher for a while.
    pub executed: u64,
    /// Milliseconds that a program that had to be run cost, from lowering to answers; 0 if there was none.
    pub ms_per_uncached: f64,
}

impl Record {
    /// The record with an empty timing: what is the same for every run.
    pub fn without_timing(&self) -> Record {
        Record { timing: GenerationTiming::default(), ..self.clone() }
    }

    /// The numbers of a generation. The first `unaltered` cases are no altered copies, `so_far` is the highest number of cases solved in earlier ones, and
    /// `evaluations` those for this generation and for all before it.
    pub(super) fn of(
        generation: u32,
        population: &[Member],
        unaltered: usize,
        so_far: u32,
        evaluations: (u64, u64),
        initial: Option<InitialDraws>,
    ) -> Record {
        let cases = population.first().map_or(0, |m| m.outcome.solved.len()) as u32;
        let count = population.len().max(1) as f64;
        let mut correct: Vec<u32> = population.iter().map(Member::correct).collect();
        let member = best_of(population);
        let best = member.map_or((0, 0), |m| (m.correct(), m.individual().len() as u32));
        let of_unaltered = |m: &Member| share(m.outcome.solved.count_of_first(unaltered), unaltered as u32);
        let total: u64 = correct.iter().map(|&c| u64::from(c)).sum();
        correct.sort_unstable();
        let sizes = population.iter().map(|m| m.individual().len() as u64);
        let depths = population.iter().map(|m| m.individual().depth() as u64);
        let genotypes: Vec<&Genotype> = population.iter().map(|m| &m.genotype).collect();
        let firsts = Genotype::representatives(&genotypes);
        let distinct = firsts.iter().enumerate().filter(|&(i, &first)| i == first).count();
        let diversity = Diversity::of(population, unaltered);
        let constant = population.iter().filter(|m| m.outcome.constant).count();
        Record {
            generation,
            best_fitness: share(best.0, cases),
            mean_fitness: total as f64 / count / f64::from(cases.max(1)),
            median_fitness: median(&correct) / f64::from(cases.max(1)),
            best_fitness_so_far: share(best.0.max(so_far), cases),
            best_fitness_unaltered: member.filter(|_| unaltered < cases as usize).map(of_unaltered),
            validation_fitness: None,
            evaluations: evaluations.0,
            evaluations_total: evaluations.0 + evaluations.1,
            best_nodes: best.1,
            mean_nodes: sizes.clone().sum::<u64>() as f64 / count,
            max_nodes: sizes.max().unwrap_or(0) as u32,
            mean_depth: depths.clone().sum::<u64>() as f64 / count,
            max_depth: depths.max().unwrap_or(0) as u32,
            distinct_programs: distinct as u32,
            distinct_behaviours: diversity.behaviours,
            constant_share: constant as f64 / count,
            largest_behaviour: Some(diversity.largest),
            case_entropy: Some(diversity.case_entropy),
            solved_by_nobody: Some(diversity.solved_by_nobody),
            hardest_case: diversity.hardest,
            warning: None,
            operations_before: None,
            operations_after: None,
            distinct_optimised: None,
            initial,
            timing: GenerationTiming::default(),
        }
    }
}

/// The best member: highest fitness, ties broken by fewer nodes, then by the lower index.
pub(super) fn best_of(population: &[Member]) -> Option<&Member> {
    population.iter().min_by_key(|m| (std::cmp::Reverse(m.correct()), m.individual().len()))
}

/// Of ascending numbers; of an even number of them the mean of the middle two.
fn median(sorted: &[u32]) -> f64 {
    let (Some(&low), Some(&high)) =
        (sorted.get(sorted.len().saturating_sub(1) / 2), sorted.get(sorted.len() / 2))
    else {
        return 0.0;
    };
    (f64::from(low) + f64::from(high)) / 2.0
}
