//! `vsonar label`: the page on which labels are made.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::Duration;

use serde::Serialize;
use vsonar::dataset::Deeper;
use vsonar::dataset::scale::useful_size;
use vsonar::detector::ProgramDetector;
use vsonar::ir::opt;
use vsonar::label::{self, Columns, LeftOut, Progress, Session, SessionError};
use vsonar::support::printable::{ShownPath as _, line};
use vsonar::web::Server;

use super::executor::with_stack;
use super::gray_note::note_gray;
use super::output::{self, count, shell_word};
use super::program::{self, Loaded};
use super::{CliError, interrupt, large, notices, run_columns, serve};

const EXAMPLES: &str = "\
Examples:
  vsonar label photos                           six columns of each image in the folder
  vsonar label photos --columns 20,60,100       these columns
  vsonar label photos --suggest runs/photos-seed-1
      the answers of a program on request, to be accepted or corrected
  vsonar label photos --open                    show the page in the browser at once

Open the address that is printed; the page explains its keys (press ?). A label is the row, from the top, of the \
lowest pixel that is not ground; ground all the way up is 0. Every mark is saved in `labels.csv` at once, columns that \
cannot be labelled in `labels.skip.csv`; what else stands in the table stays. The page is for this machine alone, and \
only for those who know the address. Ctrl-C ends the command and says what is saved, with exit code 130.";

/// Columns unless they are given or the table has some.
const COLUMNS: u32 = 6;

/// Label images by hand, in a page that a browser on this machine shows
#[derive(Debug, clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// The folder of images; the labels that it has already are kept and shown
    dir: PathBuf,
    /// So many columns, evenly spread; or these, as in 20,60,100 (a single one as in 160,) [default: those last asked
    /// for in this folder, else those that its table has, else 6]
    #[arg(long, value_name = "N|X,X", value_parser = run_columns::parse)]
    columns: Option<run_columns::Columns>,
    /// The port of 127.0.0.1; 0 takes any that is free
    #[arg(long, value_name = "PORT", default_value_t = 0)]
    port: u16,
    /// A program whose answers are shown on request: .gp, .vir, or a run folder
    #[arg(long, value_name = "PROGRAM")]
    suggest: Option<PathBuf>,
    /// Show the page in the browser. The address is then an argument of the browser's command line, where other users
    /// of this machine can read it: for one that you share with people you do not trust, open the address yourself
    #[arg(long)]
    open: bool,
    /// Keep the address in this file, which you alone can read, and have the same again next time: a page that is open
    /// finds a command that was started again
    #[arg(long, value_name = "FILE", conflicts_with = "port")]
    address: Option<PathBuf>,
    /// Print the address and what there is to do as one line of JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Ready<'s> {
    address: String,
    folder: &'s Path,
    images: usize,
    width: u32,
    height: u32,
    /// The size that the images should be scaled to, if they are larger than is useful.
    useful_size: Option<(u32, u32)>,
    columns: &'s [u32],
    progress: Progress,
    left_out: &'s [LeftOut],
    in_subfolders: Option<&'s Deeper>,
}

/// Shows the page until Ctrl-C.
pub(crate) fn run(args: Args) -> Result<(), CliError> {
    let columns = match &args.columns {
        None => Columns::AsBefore(COLUMNS),
        Some(run_columns::Columns::Spread(n)) => Columns::Spread(*n),
        Some(run_columns::Columns::These(columns)) => Columns::These(columns.clone()),
    };
    let mut session = Session::open(&args.dir, &columns).map_err(|error| match error {
        SessionError::Columns(text) => CliError::Usage(format!("--columns: {text}")),
        other => other.into(),
    })?;
    // Labels that there are count for images as they are stored.
    let size = if session.labels_in_table() == 0 { session.size_in_viewers() } else { session.size() };
    if let Some(advice) = large::advice(session.dir(), size) {
        session.remark(advice);
    }
    if let Some(path) = &args.suggest {
        note_gray(path);
        session.suggest(Box::new(detector(path, session.size())?));
    }
    let stop = interrupt::stop_flag()?;
    let server = match &args.address {
        Some(file) => Server::bind_again(file, args.port)?,
        None => serve::bind(args.port)?,
    };
    notices::print();
    let (session, address) = (Arc::new(session), server.address());
    let running = label::serve(session.clone(), server)?;
    announce(&args, &session, &address)?;
    if args.open {
        serve::open(&address);
    }
    while !stop.load(Ordering::Relaxed) && !running.has_ended() {
        std::thread::sleep(Duration::from_millis(20));
    }
    running.stop()?;
    Err(CliError::Interrupted(saved(&session, args.columns.as_ref())))
}

/// The program of a file, or the best one of a run, for images of this size.
fn detector(path: &Path, size: (u32, u32)) -> Result<ProgramDetector, CliError> {
    let path = &program::file(path)?;
    let compiled = with_stack(|| {
        let loaded = Loaded::load(path)?;
        loaded.check_images(path, size)?;
        loaded.note_size(path, size);
        Ok(program::detector(&opt::optimise(&loaded.lowered(size)), false))
    });
    compiled?
}

fn announce(args: &Args, session: &Session, address: &str) -> Result<(), CliError> {
    let (width, height) = session.size();
    let (images, progress) = (session.images().count(), session.progress());
    if args.json {
        if args.dir.to_str().is_none() {
            let dir = args.dir.shown();
            return Err(CliError::Failed(format!(
                "{dir}: --json: the name is not UTF-8; rename the folder, or go without `--json`"
            )));
        }
        let ready = Ready {
            address: address.to_string(),
            folder: &args.dir,
            images,
            width,
            height,
            useful_size: useful_size(session.size_in_viewers()),
            columns: session.columns(),
            progress,
            left_out: session.left_out(),
            in_subfolders: session.in_subfolders(),
        };
        return output::print_json_line(&ready);
    }
    for LeftOut { name, why } in session.left_out() {
        output::say(&format!("note: left out: {}", line(&format!("{name}: {why}"))));
    }
    for note in session.notes() {
        output::say(&format!("note: {note}"));
    }
    output::print(&format!(
        "{}: {} of {width} x {height} pixels, {}; {} of {} made\nOpen {address}\n\
         Every mark is saved at once in {}. Ctrl-C ends.\n",
        args.dir.shown(),
        count(images as u64, "image"),
        count(session.columns().len() as u64, "column"),
        progress.labels + progress.skipped,
        count(progress.asked as u64, "mark"),
        output::from_here(&session.table()).shown(),
    ))
}

/// What there is when the command ends.
fn saved(session: &Session, columns: Option<&run_columns::Columns>) -> String {
    let Progress { asked, labels, skipped } = session.progress();
    let table = output::from_here(&session.table());
    let all = session.labels_in_table();
    // Those of columns that are not asked for are there all the same.
    let of_all = if all > labels {
        format!("{labels} of the {}", count(all as u64, "label"))
    } else {
        count(labels as u64, "label")
    };
    let mut text = format!(
        "{} of {} made: {of_all} in {}",
        labels + skipped,
        count(asked as u64, "mark"),
        table.shown()
    );
    if skipped > 0 {
        text += &format!(", {} skipped", count(skipped as u64, "column"));
    }
    if labels + skipped < asked {
        text += &format!("\nGo on with: vsonar label {}", shell_word(&output::from_here(session.dir())));
        match columns {
            Some(run_columns::Columns::Spread(n)) => text += &format!(" --columns {n}"),
            // One of them alone is told from a number of them by its comma.
            Some(run_columns::Columns::These(columns)) if columns.len() == 1 => {
                text += &format!(" --columns {},", columns[0]);
            }
            Some(run_columns::Columns::These(columns)) => {
                let columns: Vec<String> = columns.iter().map(u32::to_string).collect();
                text += &format!(" --columns {}", columns.join(","));
            }
            None => {}
        }
    } else {
        text += &format!("\nNext: vsonar evolve --data {}", shell_word(&output::from_here(session.dir())));
    }
    text
}
