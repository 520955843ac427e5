//! `vsonar label` as a person has it: the command, its web server, and the page in a real browser.

mod browser;
mod common;
mod http;
mod odd;
mod page;
mod processes;
