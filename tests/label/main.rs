//! `vsonar label` as a person has it: the command, its web server, and the page in a real browser; and there, too, the page
//! of `vsonar evolve --watch`.

mod browser;
mod common;
mod first;
mod http;
mod odd;
mod page;
mod processes;
mod watch;
