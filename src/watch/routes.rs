//! The page and what it asks for.

use std::io;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use axum::extract::{Query, State};
use axum::http::{StatusCode, header};
use axum::response::{Html, IntoResponse};
use axum::routing::get;
use axum::{Json, Router};
use maud::{PreEscaped, html};
use serde::{Deserialize, Serialize};

use super::board::{self, Board};
use super::sheet::{Drawn, Sheet};
use crate::report::page;
use crate::web::{Running, Server};

/// How often a page that is looked at is told how far it is.
const BEAT: Duration = Duration::from_secs(1);

/// How long a page that nobody looks at is left alone, unless it is over.
const QUIET: Duration = Duration::from_secs(25);

/// Within this time a page asks again.
const BETWEEN: Duration = Duration::from_millis(500);

/// How long an end waits at most until all that are looking know of it.
const PATIENCE: Duration = Duration::from_secs(3);

/// Seconds until a page without script is loaded again.
const REFRESH: u32 = 5;

/// Shows a board on a server, until what is returned is dropped.
///
/// # Errors
/// If the system refuses a thread.
pub fn serve(board: Arc<Board>, server: Server) -> io::Result<Served> {
    let desk =
        Arc::new(Desk { board, sheet: Mutex::default(), next: Mutex::default(), visitors: Mutex::default() });
    let css = "text/css; charset=utf-8";
    let pages = Router::new()
        .route("/", get(whole))
        .route("/news", get(news))
        .route("/style.css", get(async move || file(css, page::STYLE)))
        .route("/watch.css", get(async move || file(css, include_str!("page/watch.css"))))
        .route(
            "/watch.js",
            get(async || file("text/javascript; charset=utf-8", include_str!("page/watch.js"))),
        )
        .route("/icon.svg", get(async || file("image/svg+xml", include_str!("../label/page/icon.svg"))))
        .with_state(desk.clone());
    Ok(Served { desk, running: Some(server.start(pages)?) })
}

fn file(kind: &'static str, content: &'static str) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, kind)], content)
}

/// A page that is shown until this is dropped; whoever looks at it then is told that it is over first.
#[derive(Debug)]
pub struct Served {
    desk: Arc<Desk>,
    running: Option<Running>,
}

impl Drop for Served {
    fn drop(&mut self) {
        self.desk.board.end("The command has ended.");
        let start = Instant::now();
        while start.elapsed() < PATIENCE && self.desk.visitors().are_waiting() {
            std::thread::sleep(Duration::from_millis(10));
        }
        // The run is what counts, and it is over: whatever was wrong with the server is no news now.
        drop(self.running.take());
    }
}

/// What the answers come from.
#[derive(Debug)]
struct Desk {
    board: Arc<Board>,
    sheet: Mutex<Sheet>,
    /// The revision drawn last, and when another may be drawn.
    next: Mutex<Option<(u64, Instant)>>,
    visitors: Mutex<Visitors>,
}

/// Who looks at the page.
#[derive(Debug, Default)]
struct Visitors {
    /// Requests for news under way.
    asking: usize,
    /// When one was last answered that it goes on.
    told: Option<Instant>,
}

impl Visitors {
    /// Whether somebody does not yet know that it is over.
    fn are_waiting(&self) -> bool {
        self.asking > 0 || self.told.is_some_and(|told| told.elapsed() < BETWEEN)
    }
}

/// A request for news, while it is under way.
struct Asking(Arc<Desk>);

impl Drop for Asking {
    fn drop(&mut self) {
        self.0.visitors().asking -= 1;
    }
}

/// A failure, in words.
type Refusal = (StatusCode, String);

impl Desk {
    fn visitors(&self) -> MutexGuard<'_, Visitors> {
        self.visitors.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn ask(self: &Arc<Desk>) -> Asking {
        self.visitors().asking += 1;
        Asking(self.clone())
    }

    /// The revision drawn last and when another may be drawn; at first at once.
    fn next(&self) -> (u64, Instant) {
        let next = *self.next.lock().unwrap_or_else(PoisonError::into_inner);
        next.unwrap_or_else(|| (0, Instant::now()))
    }

    /// The report as of this state, or a moment ago. Requests wait for each other, so that it is drawn once for all.
    async fn drawn(self: &Arc<Desk>, state: board::State) -> Result<Drawn, Refusal> {
        let desk = self.clone();
        let draw = move || {
            let drawn = desk.sheet.lock().unwrap_or_else(PoisonError::into_inner).of(&state)?;
            *desk.next.lock().unwrap_or_else(PoisonError::into_inner) = Some((drawn.revision, drawn.next));
            Ok(drawn)
        };
        let failed = |words: String| (StatusCode::INTERNAL_SERVER_ERROR, words);
        let drawn: io::Result<Drawn> = tokio::task::spawn_blocking(draw)
            .await
            .map_err(|_| failed("the page cannot be drawn".to_string()))?;
        drawn.map_err(|error| failed(error.to_string()))
    }
}

/// The page as it is now; without script it is loaded again and again.
async fn whole(State(desk): State<Arc<Desk>>) -> Result<Html<String>, Refusal> {
    let state = desk.board.state();
    let (line, share, end) = (state.line(Instant::now()), state.share(), state.end.clone());
    let drawn = desk.drawn(state).await?;
    let head = html! {
        link rel="icon" href="icon.svg" type="image/svg+xml";
        link rel="stylesheet" href="style.css";
        link rel="stylesheet" href="watch.css";
        script src="watch.js" type="module" {}
        @if end.is_none() { noscript { meta http-equiv="refresh" content=(REFRESH); } }
    };
    let body = html! {
        div id="live" data-state=(if end.is_some() { "ended" } else { "running" }) {
            p id="line" { (line) }
            progress id="share" max="1" value=(share) aria-label="How far it is" {}
            p id="note" role="status" { @if let Some(end) = &end { (end) } }
        }
        div id="report" data-revision=(drawn.revision) { (PreEscaped(&*drawn.html)) }
    };
    Ok(Html(page::document(&drawn.title, &head, &body)))
}

#[derive(Deserialize)]
struct Since {
    /// The revision that the page shows.
    since: u64,
    /// Whether nobody looks at it.
    #[serde(default)]
    quiet: bool,
}

/// How far it is, and the report if it is newer than what the page shows.
#[derive(Serialize)]
struct News {
    line: String,
    share: f64,
    /// How it ended, once it has.
    end: Option<String>,
    revision: u64,
    title: Option<String>,
    report: Option<String>,
}

/// Answers when there is a newer report, when it is over, or after a moment anyway.
async fn news(
    State(desk): State<Arc<Desk>>,
    Query(Since { since, quiet }): Query<Since>,
) -> Result<Json<News>, Refusal> {
    let _asking = desk.ask();
    let until = Instant::now() + if quiet { QUIET } else { BEAT };
    let mut board = desk.board.subscribe();
    let newer = loop {
        let (revision, ended) = {
            let state = board.borrow_and_update();
            (state.revision, state.end.is_some())
        };
        let (drawn, next) = desk.next();
        let now = Instant::now();
        let newer = !quiet && revision > since;
        if ended || newer && (drawn > since || next <= now) {
            break revision > since;
        }
        if until <= now {
            break false;
        }
        let wait = if newer { until.min(next) } else { until };
        // A board that nobody tells any more is as good as one that is waited for.
        let _ = tokio::time::timeout_at(wait.into(), board.changed()).await;
    };
    let state = desk.board.state();
    let (line, share, end) = (state.line(Instant::now()), state.share(), state.end.clone());
    let drawn = if newer { Some(desk.drawn(state).await?) } else { None };
    if end.is_none() {
        desk.visitors().told = Some(Instant::now());
    }
    let revision = drawn.as_ref().map_or(since, |drawn| drawn.revision);
    let (title, report) = drawn.map(|drawn| (drawn.title.to_string(), drawn.html.to_string())).unzip();
    Ok(Json(News { line, share, end, revision, title, report }))
}
