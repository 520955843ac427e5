//! Connections: how many there may be at a time, and how long one may say nothing.
//!
//! Whoever can reach the port can open connections, and each takes a descriptor that the process needs for its files.
//! So there are only so many, and when there is one too many the oldest goes on which nobody has shown the token.

use std::collections::VecDeque;
use std::io;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use axum::{Extension, Router};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::watch;
use tokio::task::{AbortHandle, JoinSet};

/// How long connections may go on after the server is to stop: a browser may keep some open on which it asks nothing.
const LAST_ANSWERS: Duration = Duration::from_millis(300);
/// Rest after a connection could not be taken, as when there are no descriptors left.
const REST: Duration = Duration::from_millis(100);

/// What connections are allowed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Most connections at a time.
    pub(super) connections: usize,
    /// How long the head of a request may take to come, from the connection's beginning or the last answer on.
    pub(super) head: Duration,
}

impl Limits {
    /// A browser opens six at a time for each of its windows.
    const CONNECTIONS: usize = 128;

    /// Those of this process: at most a quarter of the descriptors that it may have, the rest being for its files.
    pub(super) fn of_process() -> Limits {
        let descriptors = usize::try_from(descriptors()).unwrap_or(usize::MAX);
        let connections = (descriptors / 4).clamp(4, Limits::CONNECTIONS);
        Limits { connections, head: Duration::from_secs(10) }
    }
}

/// How many descriptors this process may have.
#[cfg(unix)]
fn descriptors() -> u64 {
    use nix::sys::resource::{Resource, getrlimit};
    getrlimit(Resource::RLIMIT_NOFILE).map_or(1024, |(allowed, _)| allowed)
}

#[cfg(not(unix))]
fn descriptors() -> u64 {
    1024
}

/// Whether somebody has shown the token on a connection. It is an extension of every request.
#[derive(Debug, Clone, Default)]
pub(super) struct Visitor(Arc<AtomicBool>);

impl Visitor {
    /// Says that the token was shown.
    pub(super) fn let_in(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn is_let_in(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// The connections that there are, the oldest first.
struct Connections {
    most: usize,
    open: VecDeque<(Visitor, AbortHandle)>,
}

impl Connections {
    /// Makes room for one more, if there is any to be had.
    fn make_room(&mut self) -> bool {
        self.open.retain(|(_, task)| !task.is_finished());
        if self.open.len() < self.most {
            return true;
        }
        let stranger = self.open.iter().position(|(visitor, _)| !visitor.is_let_in());
        let stranger = stranger.and_then(|place| self.open.remove(place));
        stranger.inspect(|(_, task)| task.abort()).is_some()
    }
}

/// Answers requests until `stopped` is done, and then those that are under way.
pub(super) async fn serve(
    listener: TcpListener,
    app: Router,
    limits: Limits,
    stopped: impl Future<Output = ()>,
) {
    let (stop, stopping) = watch::channel(());
    let mut connections = Connections { most: limits.connections, open: VecDeque::new() };
    let mut tasks = JoinSet::new();
    let mut stopped = pin!(stopped);
    loop {
        let accepted = tokio::select! {
            () = stopped.as_mut() => break,
            accepted = listener.accept() => accepted,
        };
        while tasks.try_join_next().is_some() {}
        match accepted {
            Ok((stream, _)) => {
                // Where all have shown the token, who comes last has to wait.
                if connections.make_room() {
                    let visitor = Visitor::default();
                    let app = app.clone().layer(Extension(visitor.clone()));
                    let task = tasks.spawn(answer(stream, app, limits.head, stopping.clone()));
                    connections.open.push_back((visitor, task));
                }
            }
            // Whoever wanted something has gone.
            Err(error) if is_of_the_other_side(&error) => {}
            Err(_) => tokio::time::sleep(REST).await,
        }
    }
    drop(stop);
    let all = async { while tasks.join_next().await.is_some() {} };
    // What is not done by then is not waited for.
    let _ = tokio::time::timeout(LAST_ANSWERS, all).await;
}

/// Answers the requests on a connection until it is closed, or the sender of `stopping` is gone.
async fn answer(stream: TcpStream, app: Router, head: Duration, mut stopping: watch::Receiver<()>) {
    let mut builder = http1::Builder::new();
    builder.timer(TokioTimer::new()).header_read_timeout(head);
    let mut connection = pin!(builder.serve_connection(TokioIo::new(stream), TowerToHyperService::new(app)));
    // What goes wrong on a connection is the matter of whoever opened it.
    let _ = tokio::select! {
        done = connection.as_mut() => done,
        _ = stopping.changed() => {
            connection.as_mut().graceful_shutdown();
            connection.await
        }
    };
}

fn is_of_the_other_side(error: &io::Error) -> bool {
    use io::ErrorKind::{ConnectionAborted, ConnectionRefused, ConnectionReset};
    matches!(error.kind(), ConnectionAborted | ConnectionRefused | ConnectionReset)
}

#[cfg(test)]
mod tests {
    use std::io::{Read, Write};
    use std::net::TcpStream as Client;
    use std::time::Instant;

    use super::*;
    use crate::web::{Running, Server};

    const MOST: usize = 8;

    fn start(head: Duration) -> (Running, String) {
        let server = Server::bind(0).expect("any port");
        let address = server.address();
        let pages = Router::new().route("/", axum::routing::get(|| async { "page" }));
        let limits = Limits { connections: MOST, head };
        (server.start_within(pages, limits).expect("a thread"), address)
    }

    fn host(address: &str) -> &str {
        address.strip_prefix("http://").and_then(|rest| rest.split('/').next()).expect("an address")
    }

    fn connect(address: &str) -> Client {
        let client = Client::connect(host(address)).expect("it listens");
        client.set_read_timeout(Some(Duration::from_secs(60))).expect("a timeout");
        client
    }

    /// Asks for the page and keeps the connection; the status.
    fn ask(client: &mut Client, address: &str, path: &str) -> io::Result<u16> {
        write!(client, "GET {path} HTTP/1.1\r\nHost: {}\r\n\r\n", host(address))?;
        let mut head = [0; 12];
        client.read_exact(&mut head)?;
        let status = std::str::from_utf8(&head).ok().and_then(|head| head[9..].parse().ok());
        status.ok_or_else(|| io::Error::other("no answer"))
    }

    fn page(address: &str) -> String {
        format!("/{}/", address.split('/').nth(3).expect("a token"))
    }

    /// Whether the other side closes the connection; waits for it.
    fn is_closed(client: &mut Client) -> bool {
        let mut rest = Vec::new();
        match client.read_to_end(&mut rest) {
            Ok(_) => true,
            Err(error) => error.kind() == io::ErrorKind::ConnectionReset,
        }
    }

    #[test]
    fn strangers_do_not_keep_anybody_out() {
        let (running, address) = start(Duration::from_secs(1000));
        let start = Instant::now();
        let page = page(&address);
        let mut known = connect(&address);
        assert_eq!(ask(&mut known, &address, &page).expect("room"), 200);
        // Nothing, half of a head, and a whole one without the token, over and over.
        let mut strangers: Vec<Client> = Vec::new();
        for number in 0..10 * MOST {
            let mut stranger = connect(&address);
            match number % 3 {
                0 => {}
                1 => write!(stranger, "GET {page} HTTP/1.1\r\nHost: ").expect("sent"),
                _ => write!(stranger, "GET / HTTP/1.1\r\nHost: {}\r\n\r\n", host(&address)).expect("sent"),
            }
            strangers.push(stranger);
            if number % MOST == 0 {
                assert_eq!(ask(&mut connect(&address), &address, &page).expect("let in"), 200);
            }
        }
        for stranger in &mut strangers[..5 * MOST] {
            assert!(is_closed(stranger));
        }
        // Who has shown the token stays.
        let mut rest = [0; 4096];
        let _ = known.read(&mut rest).expect("the rest of the first answer");
        assert_eq!(ask(&mut known, &address, &page).expect("still open"), 200);
        assert!(start.elapsed() < Duration::from_secs(60));
        running.stop().expect("no failure");
    }

    #[test]
    fn those_who_know_the_token_share_what_there_is() {
        let (running, address) = start(Duration::from_secs(1000));
        let page = page(&address);
        let mut known: Vec<Client> = (0..MOST).map(|_| connect(&address)).collect();
        for client in &mut known {
            assert_eq!(ask(client, &address, &page).expect("room"), 200);
        }
        assert!(is_closed(&mut connect(&address)), "one too many");
        drop(known);
        // As soon as it is known that they are gone there is room again.
        let start = Instant::now();
        while ask(&mut connect(&address), &address, &page).is_err() {
            assert!(start.elapsed() < Duration::from_secs(60), "no room");
        }
        running.stop().expect("no failure");
    }

    #[test]
    fn who_says_nothing_is_not_waited_for() {
        let (running, address) = start(Duration::from_millis(50));
        let mut silent = connect(&address);
        let mut slow = connect(&address);
        write!(slow, "GET / HTTP/1.1\r\nHost: ").expect("sent");
        let mut known = connect(&address);
        assert_eq!(ask(&mut known, &address, &page(&address)).expect("room"), 200);
        for client in [&mut silent, &mut slow, &mut known] {
            assert!(is_closed(client));
        }
        running.stop().expect("no failure");
    }

    #[test]
    fn a_quarter_of_the_descriptors_at_most() {
        let Limits { connections, .. } = Limits::of_process();
        assert!((4..=Limits::CONNECTIONS).contains(&connections));
        assert!(connections as u64 <= descriptors() / 4 || connections == 4);
    }
}
