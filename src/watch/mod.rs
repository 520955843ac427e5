//! Runs on a page while they go on: that of [`report`](crate::report::page), as far as there is something to tell.
//!
//! ```text
//! run ──(a generation is recorded)──> Board ──┐
//! run folder ──> Run::read ──> html ──> Sheet ┴──> routes ──> page, in a browser on this machine
//! ```
//! Whoever runs them tells a [`Board`] of each generation, which is all that a run is burdened with. The rest is read
//! from the run folders and drawn on the server's threads: when a browser asks, once a generation, and at most a tenth of
//! the time. [`serve`] answers the browser. The page needs neither inline style nor foreign images, so that it keeps the
//! strict policy of [`web`](crate::web).
//!
//! ```
//! use vsonar::watch::{Board, serve};
//! use vsonar::web::Server;
//!
//! let board = Board::new(1, 51);
//! let server = Server::bind(0)?;
//! let address = server.address(); // to be opened in a browser
//! let served = serve(board.clone(), server)?;
//! assert_eq!(board.line(), "0 of 51 generations");
//! board.end("The run has ended.");
//! drop(served); // who was looking has been told
//! # Ok::<(), std::io::Error>(())
//! ```

mod board;
mod pace;
mod routes;
mod sheet;

pub use board::Board;
pub use routes::{Served, serve};
