//! `vsonar explain`: what a program does, in readable form.

use std::path::{Path, PathBuf};

use serde::Serialize;
use vsonar::dataset::Dataset;
use vsonar::explain::{self, Explanation, Trace, text};
use vsonar::support::printable::{ShownPath as _, line};
use vsonar::tree::Individual;
use vsonar::world::office::World;

use super::eval_cases::{RunPart, cases_of};
use super::executor::with_stack;
use super::gray_note::note_gray;
use super::memory::{MemoryArgs, Need};
use super::output::Own;
use super::program::{self, SIZE, size};
use super::progress::{Bar, Style};
use super::source::Source;
use super::terminal::Look;
use super::{CliError, eval, output};

const EXAMPLES: &str = "\
Examples:
  vsonar explain best.gp
  vsonar explain runs/photos-seed-1
  vsonar explain best.gp --data photos --match 'run_C*'
  vsonar explain best.gp --data photos --trace frame_7.png,160
  vsonar explain best.gp --data photos --out explained

The program is shown as the optimiser leaves it, as `if`s and formulas. The text is read back, run, and held against the \
compiled program, on every case of the data, or else on random images; one that gives other answers is an error. With \
data its margin says of a choice how often its condition holds and how often not, of a `stop` in how many cases it \
fires; and what the fitness is without each part.

`--trace` shows one case, one position of the window after the other. With `--out` the folder gets explanation.md, \
explanation.json, trees.dot, trees.svg and, with data, trace.txt and trace.svg.";

/// Show what a program does, in readable form
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The program, a .gp file; or a run folder, for its best program on its own data
    program: PathBuf,
    /// Folder with `labels.csv` and the images it names [default: the data of the run folder]
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// What `evolve --world` trains on: nsh, fmrb or combined
    #[arg(long, value_name = "NAME", conflicts_with = "data")]
    world: Option<World>,
    /// Which part of the run folder's data [default: holdout if there is one and the run is complete, else train]
    #[arg(long, value_enum, value_name = "PART", conflicts_with_all = ["data", "world"])]
    part: Option<RunPart>,
    /// Only the images whose names match this pattern, e.g. 'run_C*'
    #[arg(long = "match", value_name = "GLOB", requires = "data")]
    pattern: Option<String>,
    /// Size of the images it is explained for, without data [default: that of the images it was evolved on,
    /// else 320x240]
    #[arg(long, value_name = "WxH", value_parser = size, conflicts_with_all = ["data", "world"])]
    size: Option<(u32, u32)>,
    /// An answer is correct within this many rows of the label [default: as many as the run's settings say, else 10]
    #[arg(long, value_name = "ROWS", value_parser = eval::tolerance, allow_negative_numbers = true)]
    tolerance: Option<f64>,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Trace a case: an image by its name or its number from 1 on, and a labelled column [default: the first case]
    #[arg(long, value_name = "IMAGE,X", num_args = 0..=1, default_missing_value = "")]
    trace: Option<String>,
    /// Show every position of the trace, not only those at which another branch is taken
    #[arg(long)]
    full: bool,
    /// Write all of it into this folder
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace files in the folder that have the same names
    #[arg(long, requires = "out")]
    force: bool,
    /// Write the explanation as Markdown to this file
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Write the trees in the language of Graphviz to this file
    #[arg(long, value_name = "FILE")]
    dot: Option<PathBuf>,
    /// Write a picture of the trees, an SVG, to this file: live nodes solid, introns pale
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Write a picture of the trace, an SVG, to this file
    #[arg(long, value_name = "FILE")]
    trace_svg: Option<PathBuf>,
    /// Print the explanation as JSON
    #[arg(long)]
    json: bool,
}

/// What `--json` prints.
#[derive(Serialize)]
struct Json<'a> {
    program: &'a str,
    #[serde(flatten)]
    explanation: &'a Explanation,
    trace: Option<&'a Trace>,
}

/// Explains the program.
pub(crate) fn run(mut args: Args) -> Result<(), CliError> {
    if args.full && args.trace.is_none() && args.out.is_none() {
        let text = "--full: there is no trace to be shown in full; ask for one with `--trace`, or for all with `--out`";
        return Err(CliError::Usage(text.to_string()));
    }
    let path = program::file(&args.program)?;
    let (individual, comment) = load(&path)?;
    check_targets(&args, &path)?;
    let busy = Bar::spinner(Style::of(false), "explaining the program");
    let data = data(&args)?;
    if data.is_none() {
        args.size = args.size.or_else(|| program::evolved_on(&comment));
    }
    match &data {
        Some((set, _)) => args.memory.check([set])?,
        None => args.memory.check_needs([Need::image(args.size.unwrap_or(SIZE))])?,
    };
    if args.data.is_some() {
        note_gray(&args.program);
    }
    if let Some((set, _)) = &data {
        program::note_size(&path, &comment, (set.width(), set.height()));
    }
    let set = data.as_ref().map(|(set, _)| set);
    let case = case(&args, set)?;
    let name = path.shown();
    with_stack(|| {
        let explanation = explain(&args, &individual, data.as_ref())?;
        let trace = set.zip(case).map(|(set, case)| Trace::of(&explanation.listing, set, case));
        write(&args, &name, &individual, &explanation, set, trace.as_ref())?;
        let trace = trace.filter(|_| args.trace.is_some());
        drop(busy);
        if args.json {
            let trace = trace.as_ref();
            return output::print_json(&Json { program: &name, explanation: &explanation, trace });
        }
        let mut out = text::text_within(&explanation, &name, Look::stdout().width);
        if let Some(trace) = trace {
            out += &format!("\nTrace of {}", trace.text(args.full));
        }
        output::print(&out)
    })?
}

/// The case to be traced, by its number.
fn case(args: &Args, set: Option<&Dataset>) -> Result<Option<usize>, CliError> {
    let Some(set) = set else {
        let flag = if args.trace.is_some() { "--trace" } else { "--trace-svg" };
        return match args.trace.is_some() || args.trace_svg.is_some() {
            true => Err(CliError::Usage(format!("{flag}: there are no images; say which with `--data`"))),
            false => Ok(None),
        };
    };
    let asked = match args.trace.as_deref() {
        None | Some("") => return Ok(Some(0)),
        Some(asked) => asked,
    };
    // A name may have commas of its own.
    let with_column = asked.rsplit_once(',').and_then(|(name, x)| Some((name, Some(x.trim().parse().ok()?))));
    let find = |name: &str| {
        let by_name = set.images().iter().position(|image| image.name == name);
        let number = || name.parse::<usize>().ok().and_then(|n| n.checked_sub(1));
        by_name.or_else(number).filter(|&i| i < set.images().len())
    };
    let found = find(asked).map(|i| (i, None));
    let found = found.or_else(|| with_column.and_then(|(name, x)| Some((find(name)?, x))));
    let Some((image, x)) = found else {
        let text = format!(
            "--trace: {} has no image {}; give a name, such as {}, or a number from 1 to {}, and a column, as in 1,160",
            line(set.name()),
            line(asked),
            line(&set.images()[0].name),
            set.images().len()
        );
        return Err(CliError::Failed(text));
    };
    let wanted = |case: &vsonar::dataset::Case| case.image == image && x.is_none_or(|x: u32| case.x == x);
    let case = set.cases().iter().position(wanted);
    case.map(Some).ok_or_else(|| {
        let columns = set.cases().iter().filter(|case| case.image == image).map(|case| case.x.to_string());
        let columns: Vec<String> = columns.collect();
        let name = line(&set.images()[image].name);
        CliError::Failed(format!("--trace: the labelled columns of {name} are {}", columns.join(", ")))
    })
}

/// Writes the files that were asked for.
fn write(
    args: &Args,
    name: &str,
    individual: &Individual,
    explanation: &Explanation,
    set: Option<&Dataset>,
    trace: Option<&Trace>,
) -> Result<(), CliError> {
    let picture = || -> Result<Option<String>, CliError> {
        let Some((set, trace)) = set.zip(trace) else { return Ok(None) };
        let image = set.images().iter().find(|image| image.name == trace.image);
        Ok(image.map(|image| explain::trace_svg(trace, &image.pixels)).transpose()?)
    };
    let dot = || explain::dot(individual, &explanation.live);
    let svg = || explain::trees_svg(individual, &explanation.live);
    if let Some(folder) = &args.out {
        let json = serde_json::to_string_pretty(&Json { program: name, explanation, trace })? + "\n";
        let mut files = vec![
            ("explanation.md", text::markdown(explanation, name)),
            ("explanation.json", json),
            ("trees.dot", dot()),
            ("trees.svg", svg()),
        ];
        files.extend(trace.map(|trace| ("trace.txt", trace.text(args.full))));
        files.extend(picture()?.map(|picture| ("trace.svg", picture)));
        let files: Vec<(String, Vec<u8>)> =
            files.into_iter().map(|(name, text)| (name.to_string(), text.into_bytes())).collect();
        output::write_files(folder, &files, args.force)?;
    }
    if let Some(file) = &args.markdown {
        let text = text::markdown(explanation, name);
        MARKDOWN.write(file, &text)?;
    }
    if let Some(file) = &args.dot {
        DOT.write(file, &dot())?;
    }
    if let Some(file) = &args.svg {
        SVG.write(file, &svg())?;
    }
    if let (Some(file), Some(picture)) = (&args.trace_svg, picture()?) {
        SVG.write(file, &picture)?;
    }
    Ok(())
}

/// An explanation as Markdown.
const MARKDOWN: Own = Own { what: "explanation of a program", begins: "# ", holds: "  1  images of " };
/// Trees in the language of Graphviz.
const DOT: Own = Own { what: "picture of a program’s trees", begins: "digraph vsonar {", holds: "" };
/// A picture.
const SVG: Own = Own { what: "SVG picture", begins: "<svg xmlns=", holds: "" };

/// Refuses files that cannot be written before there is anything to write.
fn check_targets(args: &Args, program: &Path) -> Result<(), CliError> {
    let kinds = [(&args.markdown, MARKDOWN), (&args.dot, DOT), (&args.svg, SVG), (&args.trace_svg, SVG)];
    let mut known = vec![program];
    for (target, kind) in kinds.into_iter().filter_map(|(target, kind)| Some((target.as_deref()?, kind))) {
        if target == Path::new("-") {
            let text =
                "`-`: standard output has the explanation itself; give a file, `./-` if that is its name";
            return Err(CliError::Usage(text.to_string()));
        }
        if known.contains(&target) {
            return Err(CliError::Usage(format!(
                "{}: named twice, or the program itself; give each file a name of its own",
                target.shown()
            )));
        }
        kind.may_replace(target)?;
        known.push(target);
    }
    Ok(())
}

/// The program, which has to be as it was evolved: the compiler's form no longer has trees.
fn load(path: &Path) -> Result<(Individual, String), CliError> {
    if path.extension().is_some_and(|e| e == "vir") {
        let text = format!("{}: explain the program as it was evolved, a .gp file", path.shown());
        return Err(CliError::Failed(text));
    }
    Ok(Individual::load_with_text(path)?)
}

/// The cases, if there are any, and what counts as correct.
fn data(args: &Args) -> Result<Option<(Dataset, f64)>, CliError> {
    let found = match args.world {
        Some(world) => {
            Some((Source::world(world).load(args.memory.limit())?.train, vsonar::dataset::TOLERANCE))
        }
        None if args.size.is_some() => None,
        None => cases_of(&args.program, args.data.as_deref(), args.pattern.as_ref(), args.part, args.memory)?,
    };
    if found.is_none() && args.part.is_some() {
        let text = format!("--part: {} is no run folder; give one, or `--data`", args.program.shown());
        return Err(CliError::Usage(text));
    }
    Ok(found.map(|(set, tolerance)| (set, args.tolerance.unwrap_or(tolerance))))
}

fn explain(
    args: &Args,
    individual: &Individual,
    data: Option<&(Dataset, f64)>,
) -> Result<Explanation, CliError> {
    let (width, height) = data.map_or(args.size.unwrap_or(SIZE), |(set, _)| (set.width(), set.height()));
    let mut explanation = Explanation::new(individual, width, height)?;
    if let Some(why) = &explanation.why_interpreted {
        program::note_interpreted(why);
    }
    if let Some((set, tolerance)) = data {
        explanation.add_data(set, *tolerance)?;
    }
    Ok(explanation)
}
