//! `gonogo lsp`: the language server on standard input and output.
//!
//! One thread answers messages and runs the quick stages; another runs the slow ones (solids, contacts, view) when typing
//! pauses or a text is saved, and stops between two stages when the text changes.

use super::Exit;
use super::output::{self, Failure};
use crate::assembly::piece::Shelf;
use crate::diag::{Diagnostic, Sources};
use crate::lsp::{Fault, Job, Notice, Server, name};
use crate::{Compiled, Options};
use lsp_server::{Connection, Message, Notification, Request, Response, ResponseError};
use lsp_types::Uri;
use serde_json::Value;
use std::collections::BTreeSet;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::str::FromStr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread;
use std::time::{Duration, Instant};

/// A pause in typing after which the slow stages begin.
const PAUSE: Duration = Duration::from_millis(400);
/// More specs than this in a workspace, or folders deeper, are not looked at.
const MAX_SPECS: usize = 2000;
const MAX_DEPTH: usize = 8;

/// What wakes the server.
enum Event {
    Message(Message),
    /// The client has closed the pipe.
    End,
    Found(Box<Found>),
}

/// What the slow stages found; nothing if they were stopped.
struct Found {
    job: Job,
    result: Option<(Vec<Diagnostic>, Sources)>,
}

/// Serves until the client says goodbye.
pub fn lsp() -> Result<Exit, Failure> {
    let (connection, threads) = Connection::stdio();
    let (events, inbox) = channel();
    let messages = connection.receiver.clone();
    let forwarded = events.clone();
    thread::spawn(move || {
        messages.into_iter().try_for_each(|message| forwarded.send(Event::Message(message))).ok();
        forwarded.send(Event::End).ok();
    });
    let checker = Checker::start(events);
    let clean = Loop { connection: &connection, inbox, checker, server: Server::new(Box::new(read)), due: None }.run();
    drop(connection);
    if clean {
        threads.join().map_err(|e| Failure(format!("the client's pipe broke: {e}")))?;
        return Ok(Exit::Fine);
    }
    Ok(Exit::Faults)
}

/// The text of a file of this machine.
fn read(name: &str) -> std::io::Result<String> {
    String::from_utf8(output::read_file(Path::new(name))?)
        .map_err(|_| std::io::Error::new(std::io::ErrorKind::InvalidData, "it is not UTF-8 text"))
}

struct Loop<'c> {
    connection: &'c Connection,
    inbox: Receiver<Event>,
    checker: Checker,
    server: Server,
    /// When the slow stages begin.
    due: Option<Instant>,
}

impl Loop<'_> {
    /// Whether the client left in due form.
    fn run(&mut self) -> bool {
        loop {
            let event = match self.inbox.try_recv() {
                Ok(event) => event,
                // All that has been typed so far is in.
                Err(_) => {
                    self.quick_stages();
                    match self.wait() {
                        Some(event) => event,
                        None => continue,
                    }
                }
            };
            match event {
                Event::End => return self.server.is_shut_down(),
                Event::Message(Message::Request(request)) => self.request(request),
                Event::Message(Message::Notification(notice)) if notice.method == "exit" => {
                    return self.server.is_shut_down();
                }
                Event::Message(Message::Notification(notice)) => self.notification(notice),
                Event::Message(Message::Response(_)) => {}
                Event::Found(found) => self.found(*found),
            }
        }
    }

    /// The next event; none when it is time for the slow stages.
    fn wait(&mut self) -> Option<Event> {
        let Some(due) = self.due else { return Some(self.inbox.recv().unwrap_or(Event::End)) };
        match self.inbox.recv_timeout(due.saturating_duration_since(Instant::now())) {
            Ok(event) => Some(event),
            Err(RecvTimeoutError::Disconnected) => Some(Event::End),
            Err(RecvTimeoutError::Timeout) => {
                self.slow_stages();
                None
            }
        }
    }

    fn request(&mut self, request: Request) {
        let Request { id, method, params } = request;
        let folders = (method == "initialize").then(|| folders(&params));
        let outcome = self.server.request(&method, params);
        if let (Ok(_), Some(folders)) = (&outcome, folders) {
            self.server.know(specs(&folders));
        }
        let outcome = outcome.map_err(|Fault { code, message }| ResponseError { code, message, data: None });
        self.send(Message::Response(Response { id, response_result: outcome }));
    }

    fn notification(&mut self, notice: Notification) {
        let before = self.server.revision();
        match self.server.notification(&notice.method, notice.params) {
            Ok(saved) if saved => self.slow_stages(),
            Ok(_) => {}
            // A notification has no answer, but somebody may read the log.
            Err(Fault { message, .. }) => {
                let params = serde_json::json!({ "type": 1, "message": format!("{}: {message}", notice.method) });
                self.tell([("window/logMessage", params)]);
            }
        }
        if self.server.revision() != before {
            self.checker.stop();
            self.due = Some(Instant::now() + PAUSE);
        }
    }

    fn quick_stages(&mut self) {
        let notices = self.server.refresh();
        self.tell(notices);
    }

    fn slow_stages(&mut self) {
        self.quick_stages();
        self.due = None;
        let jobs = self.server.jobs();
        self.checker.begin(jobs);
    }

    fn found(&mut self, Found { job, result }: Found) {
        if let Some((diagnostics, sources)) = result {
            let notices = self.server.checked(&job, diagnostics, sources);
            self.tell(notices);
        }
    }

    fn tell(&self, notices: impl IntoIterator<Item = Notice>) {
        for (method, params) in notices {
            self.send(Message::Notification(Notification { method: method.to_string(), params }));
        }
    }

    /// A client that has gone away is noticed at the other end of the pipe.
    fn send(&self, message: Message) {
        self.connection.sender.send(message).ok();
    }
}

/// The thread of the slow stages.
struct Checker {
    jobs: Sender<(Job, Arc<AtomicBool>)>,
    /// Stops what is under way.
    stop: Arc<AtomicBool>,
}

impl Checker {
    fn start(events: Sender<Event>) -> Checker {
        let (jobs, inbox) = channel::<(Job, Arc<AtomicBool>)>();
        thread::spawn(move || {
            let shelf = Arc::default();
            for (job, stop) in inbox {
                let result = check(&job, &stop, &shelf);
                if events.send(Event::Found(Box::new(Found { job, result }))).is_err() {
                    return;
                }
            }
        });
        Checker { jobs, stop: Arc::default() }
    }

    fn stop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        self.stop = Arc::default();
    }

    fn begin(&mut self, jobs: Vec<Job>) {
        self.stop();
        for job in jobs {
            self.jobs.send((job, self.stop.clone())).ok();
        }
    }
}

/// The slow stages; nothing if they were stopped or failed. Parts that have not changed since the last time are not made again.
fn check(job: &Job, stop: &Arc<AtomicBool>, shelf: &Arc<Shelf>) -> Option<(Vec<Diagnostic>, Sources)> {
    if stop.load(Ordering::Relaxed) {
        return None;
    }
    let (stop_too, shelf) = (Some(stop.clone()), Some(shelf.clone()));
    let options = Options { stop: stop_too, shelf, ..Options::default() };
    let text_of = |name: &str| job.texts.get(name).map_or_else(|| read(name), |text| Ok(text.clone()));
    // Whatever goes wrong in there, the editor keeps its server.
    let compiled = catch_unwind(AssertUnwindSafe(|| crate::compile(&job.root, &text_of, &options, &|_| {})));
    let Compiled { diagnostics, sources, .. } = compiled.ok()?;
    (!stop.load(Ordering::Relaxed)).then_some((diagnostics, sources))
}

/// The folders of the workspace, by name.
fn folders(params: &Value) -> Vec<String> {
    let uri = |value: &Value| value.as_str().and_then(|text| Uri::from_str(text).ok()).map(|uri| name(&uri));
    let listed = params["workspaceFolders"].as_array().into_iter().flatten().filter_map(|folder| uri(&folder["uri"]));
    let mut folders: Vec<String> = listed.collect();
    if folders.is_empty() {
        folders.extend(uri(&params["rootUri"]));
    }
    folders
}

/// The specs in these folders, in the order of their names.
fn specs(folders: &[String]) -> Vec<String> {
    let mut found = BTreeSet::new();
    folders.iter().for_each(|folder| collect(Path::new(folder), 0, &mut found));
    found.into_iter().collect()
}

fn collect(folder: &Path, depth: usize, found: &mut BTreeSet<String>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    let mut paths: Vec<_> = entries.filter_map(|entry| entry.ok().map(|e| e.path())).collect();
    paths.sort();
    for path in paths {
        let hidden = path.file_name().is_some_and(|n| n.to_string_lossy().starts_with('.'));
        if hidden || found.len() >= MAX_SPECS {
            continue;
        }
        // A link to a folder may lead in circles.
        if path.is_dir() && !path.is_symlink() {
            let built = path.ends_with("target") || path.ends_with("node_modules");
            if !built && depth < MAX_DEPTH {
                collect(&path, depth + 1, found);
            }
        } else if path.extension().is_some_and(|e| e == "gng") {
            found.insert(path.to_string_lossy().replace('\\', "/"));
        }
    }
}
