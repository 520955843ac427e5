//! A small web server for this machine alone, under the pages that commands show.
//!
//! It listens on 127.0.0.1 only. The first part of every path is a random token of 128 bits, so that neither another
//! user of the machine nor a page of another site that guesses the port gets in; what comes for another host name, from
//! another site or with an oversized body is refused before any page sees it. Pages load nothing from elsewhere. There
//! are only so many connections at a time, and those on which nobody has shown the token make room for others.
//!
//! ```
//! let server = vsonar::web::Server::bind(0)?;
//! assert!(server.address().starts_with("http://127.0.0.1:"));
//! # Ok::<(), std::io::Error>(())
//! ```

mod address;
mod connections;
mod gate;
mod token;

use std::io;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::middleware::from_fn_with_state;
use tokio::sync::oneshot;

pub use address::AddressError;
pub use token::Token;

use connections::Limits;
use gate::Gate;

/// Most bytes of a request's body.
pub const MAX_BODY: usize = 64 << 10;

/// How long requests under way may take after the server has been told to stop.
const LAST_REQUESTS: Duration = Duration::from_secs(5);

/// A server that has its address, but does not answer yet.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    port: u16,
    token: Token,
}

impl Server {
    /// Takes a port of 127.0.0.1, 0 for any that is free, and draws a token.
    ///
    /// # Errors
    /// If the port is taken or not allowed, or the system gives no random numbers.
    pub fn bind(port: u16) -> io::Result<Server> {
        Server::with_token(port, Token::random()?)
    }

    fn with_token(port: u16, token: Token) -> io::Result<Server> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))?;
        listener.set_nonblocking(true)?;
        let port = listener.local_addr()?.port();
        Ok(Server { listener, port, token })
    }

    /// The port.
    pub fn port(&self) -> u16 {
        self.port
    }

    /// What a browser is to open. Who knows it may do all that the pages can.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/{}/", self.port, self.token)
    }

    /// Answers requests with these pages, on a thread of its own.
    pub(crate) fn start(self, pages: Router) -> io::Result<Running> {
        self.start_within(pages, Limits::of_process())
    }

    fn start_within(self, pages: Router, limits: Limits) -> io::Result<Running> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
        let gate = Arc::new(Gate::new(self.port, self.token.clone()));
        let app = Router::new()
            .nest(&format!("/{}/", self.token), pages)
            .layer(DefaultBodyLimit::max(MAX_BODY))
            .layer(from_fn_with_state(gate, gate::guard));
        let (stop, stopped) = oneshot::channel::<()>();
        let serve = async move {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            // The sender is gone when the server is to stop.
            let stopped = async move { drop(stopped.await) };
            connections::serve(listener, app, limits, stopped).await;
            Ok(())
        };
        let thread = std::thread::Builder::new().name("web".into()).spawn(move || {
            let done = runtime.block_on(serve);
            // What is being written to the disk is written to its end.
            runtime.shutdown_timeout(LAST_REQUESTS);
            done
        })?;
        Ok(Running { stop: Some(stop), thread: Some(thread) })
    }
}

/// A server that answers until this is dropped.
#[derive(Debug)]
pub struct Running {
    stop: Option<oneshot::Sender<()>>,
    thread: Option<JoinHandle<io::Result<()>>>,
}

impl Running {
    /// Whether the server has ended by itself, which it does only when it fails.
    pub fn has_ended(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// Ends the server; what has been asked is still answered.
    ///
    /// # Errors
    /// What made it fail before, if anything did.
    pub fn stop(mut self) -> io::Result<()> {
        self.end()
    }

    fn end(&mut self) -> io::Result<()> {
        drop(self.stop.take());
        match self.thread.take().map(JoinHandle::join) {
            None => Ok(()),
            Some(Ok(done)) => done,
            Some(Err(_)) => Err(io::Error::other("the web server failed")),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // Whoever wants to know calls `stop`.
        let _ = self.end();
    }
}
