//! The page and what it asks for. Images go by their number, so that no request can name a file.

use std::io;
use std::sync::Arc;

use axum::extract::{Path, Query, State};
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use serde::{Deserialize, Serialize};

use super::LeftOut;
use super::mark::Change;
use super::session::{Cell, Session, ShowError};
use super::store::StoreError;
use crate::support::printable;
use crate::web::{Running, Server, Token};

/// Shows a session on a server, until what is returned is dropped.
///
/// # Errors
/// If the system refuses a thread or random numbers.
pub fn serve(session: Arc<Session>, server: Server) -> io::Result<Running> {
    let desk = Desk { session, id: Token::random()?.to_string() };
    let pages = Router::new()
        .route("/", get(async || file("text/html; charset=utf-8", include_str!("page/index.html"))))
        .route("/style.css", get(async || file("text/css; charset=utf-8", include_str!("page/style.css"))))
        .route("/label.js", get(async || script(include_str!("page/label.js"))))
        .route("/desk.js", get(async || script(include_str!("page/desk.js"))))
        .route("/keys.js", get(async || script(include_str!("page/keys.js"))))
        .route("/marks.js", get(async || script(include_str!("page/marks.js"))))
        .route("/pace.js", get(async || script(include_str!("page/pace.js"))))
        .route("/pointers.js", get(async || script(include_str!("page/pointers.js"))))
        .route("/screen.js", get(async || script(include_str!("page/screen.js"))))
        .route("/view.js", get(async || script(include_str!("page/view.js"))))
        .route("/icon.svg", get(async || file("image/svg+xml", include_str!("page/icon.svg"))))
        .route("/session", get(begin))
        .route("/changes", get(changes))
        .route("/marks", post(mark))
        .route("/image/{index}", get(image))
        .route("/suggestions/{index}", get(suggestions))
        .with_state(desk);
    server.start(pages)
}

/// What the answers come from.
#[derive(Clone)]
struct Desk {
    session: Arc<Session>,
    /// Differs each time the command is started: revisions begin anew then.
    id: String,
}

impl Desk {
    /// Does what may wait for the disk.
    async fn work<T: Send + 'static>(
        &self,
        work: impl FnOnce(&Session) -> T + Send + 'static,
    ) -> Result<T, Refusal> {
        let session = self.session.clone();
        let failed = |_| Refusal(StatusCode::INTERNAL_SERVER_ERROR, "the request failed".to_string());
        tokio::task::spawn_blocking(move || work(&session)).await.map_err(failed)
    }
}

/// An answer that says what is wrong, for the page to show.
struct Refusal(StatusCode, String);

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.0, Json(serde_json::json!({ "error": printable::line(&self.1) }))).into_response()
    }
}

impl From<StoreError> for Refusal {
    fn from(error: StoreError) -> Refusal {
        Refusal(StatusCode::INTERNAL_SERVER_ERROR, error.to_string())
    }
}

impl From<ShowError> for Refusal {
    fn from(error: ShowError) -> Refusal {
        let status = match error {
            ShowError::NoImage | ShowError::NoDetector => StatusCode::NOT_FOUND,
            _ => StatusCode::INTERNAL_SERVER_ERROR,
        };
        Refusal(status, error.to_string())
    }
}

fn file(kind: &'static str, content: &'static str) -> impl IntoResponse {
    ([(header::CONTENT_TYPE, kind)], content)
}

fn script(content: &'static str) -> impl IntoResponse {
    file("text/javascript; charset=utf-8", content)
}

/// All that a page needs to begin.
#[derive(Serialize)]
struct Beginning {
    id: String,
    /// What tells the folder from others; goes with every mark.
    identity: String,
    folder: String,
    images: Vec<String>,
    /// The names of the images as they are shown.
    shown: Vec<String>,
    width: u32,
    height: u32,
    columns: Vec<u32>,
    left_out: Vec<LeftOut>,
    notes: Vec<String>,
    /// Those of the notes that are to be read before anything is marked.
    remarks: Vec<String>,
    suggests: bool,
    revision: u64,
    marks: Vec<Cell>,
}

/// Text from outside as a page shows it.
fn shown(text: &str) -> String {
    printable::line(text).into_owned()
}

async fn begin(State(desk): State<Desk>) -> Result<Json<Beginning>, Refusal> {
    let (revision, marks) = desk.work(|session| session.since(0)).await??;
    let session = &desk.session;
    let (width, height) = session.size();
    let folder = shown(&session.dir().file_name().unwrap_or(session.dir().as_os_str()).to_string_lossy());
    let left_out = |one: &LeftOut| LeftOut { name: shown(&one.name), why: shown(&one.why) };
    Ok(Json(Beginning {
        id: desk.id,
        identity: session.identity(),
        folder,
        images: session.images().map(String::from).collect(),
        shown: session.images().map(shown).collect(),
        width,
        height,
        columns: session.columns().to_vec(),
        left_out: session.left_out().iter().map(left_out).collect(),
        notes: session.notes(),
        remarks: session.remarks().to_vec(),
        suggests: session.suggests(),
        revision,
        marks,
    }))
}

#[derive(Deserialize)]
struct Since {
    since: u64,
}

/// Marks that others have made.
#[derive(Serialize)]
struct News {
    id: String,
    revision: u64,
    marks: Vec<Cell>,
}

async fn changes(
    State(desk): State<Desk>,
    Query(Since { since }): Query<Since>,
) -> Result<Json<News>, Refusal> {
    let (revision, marks) = desk.work(move |session| session.since(since)).await??;
    Ok(Json(News { id: desk.id, revision, marks }))
}

#[derive(Deserialize)]
struct Marks {
    /// The folder that they are for: an address that is kept may serve another one by now, with images of the same
    /// names.
    identity: String,
    marks: Vec<Change>,
}

async fn mark(
    State(desk): State<Desk>,
    Json(Marks { identity, marks }): Json<Marks>,
) -> Result<Response, Refusal> {
    if identity != desk.session.identity() {
        let name = desk.session.dir().file_name().unwrap_or_default().to_string_lossy().into_owned();
        return Err(Refusal(StatusCode::CONFLICT, format!("vsonar labels another folder now, {name}.")));
    }
    if let Some(fault) = marks.iter().find_map(|change| desk.session.fault(change)) {
        return Err(Refusal(StatusCode::UNPROCESSABLE_ENTITY, fault));
    }
    let applied = desk.work(|session| session.apply(marks)).await??;
    Ok(Json(applied).into_response())
}

/// The command from which a page has the numbers of images: another one may count otherwise.
#[derive(Deserialize)]
struct Counted {
    id: Option<String>,
}

impl Counted {
    fn check(self, desk: &Desk) -> Result<(), Refusal> {
        match self.id {
            Some(id) if id != desk.id => {
                Err(Refusal(StatusCode::CONFLICT, "vsonar was started again".to_string()))
            }
            _ => Ok(()),
        }
    }
}

async fn image(
    State(desk): State<Desk>,
    Path(index): Path<usize>,
    Query(counted): Query<Counted>,
) -> Result<Response, Refusal> {
    counted.check(&desk)?;
    let png = desk.work(move |session| session.png(index)).await??;
    Ok(([(header::CONTENT_TYPE, "image/png")], png).into_response())
}

async fn suggestions(
    State(desk): State<Desk>,
    Path(index): Path<usize>,
    Query(counted): Query<Counted>,
) -> Result<Json<Vec<Option<u32>>>, Refusal> {
    counted.check(&desk)?;
    Ok(Json(desk.work(move |session| session.suggestions(index)).await??))
}
