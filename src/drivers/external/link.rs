//! One connection to a driving system: a process in a separate group with three pipes, or a socket.
//!
//! All reading and writing is non-blocking, in one place and on the caller's thread, so a question costs two switches
//! between processes and no thread can be left behind. Lines and standard error are bounded, whatever comes. This is
//! the one file of the layer that asks the clock: for time limits, which decide nothing but that an answer is
//! missing, and for how long an answer took. The log has the consequences of a missing answer.

use std::collections::BTreeSet;
use std::io::{ErrorKind, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use nix::fcntl::{FcntlArg, OFlag, fcntl};
use nix::poll::{PollFd, PollFlags, PollTimeout, poll};
use nix::sys::signal::{SigSet, Signal, killpg};
use nix::unistd::Pid;

use avastra_base::outside::Shown;

use super::finding::{Problem, harmless};
use super::settings::{ExternalSettings, Target};

/// A line from a driving system is at most this long, bytes.
pub const LINE_BYTES_MAX: usize = 1 << 20;
/// This much of standard error is kept, bytes.
const STDERR_BYTES_KEPT: usize = 64 << 10;
/// More than this on standard error in one episode is a flood, bytes.
const STDERR_BYTES_MAX: u64 = 64 << 20;
/// Bytes read at once.
const CHUNK_BYTES: usize = 64 << 10;
/// A process that closed its output has this long to end, so that its exit status can be told.
const ENDING_S: f64 = 0.5;
/// Between SIGTERM and SIGKILL.
const TERM_S: f64 = 2.0;
/// So often it is looked whether a silent process still lives, ms.
const ALIVE_MS: u16 = 100;
/// So often, 1 ms apart, it is looked whether a killed process has ended, before it is left.
const REAP_LOOKS: u32 = 2000;

/// The process groups that were started and not ended.
static GROUPS: Mutex<BTreeSet<i32>> = Mutex::new(BTreeSet::new());

/// Ends all processes of driving systems at once, before this one ends.
pub fn end_all() {
    for group in core::mem::take(&mut *groups()) {
        // It fails only if no process of the group is left.
        let _ = killpg(Pid::from_raw(group), Signal::SIGKILL);
    }
}

fn groups() -> std::sync::MutexGuard<'static, BTreeSet<i32>> {
    GROUPS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Why no line came: what is wrong, and details in words.
#[derive(Debug)]
pub struct Broken {
    pub problem: Problem,
    pub detail: String,
}

/// A time limit by the wall clock.
#[derive(Debug, Clone, Copy)]
pub struct Deadline {
    begun: Instant,
    limit: Duration,
}

impl Deadline {
    /// One that begins now.
    pub fn after(limit_s: f64) -> Deadline {
        Deadline { begun: now(), limit: Duration::from_secs_f64(limit_s) }
    }

    /// The time since it began, s.
    pub fn elapsed_s(self) -> f64 {
        now().saturating_duration_since(self.begun).as_secs_f64()
    }

    fn left(self) -> Duration {
        self.limit.saturating_sub(now().saturating_duration_since(self.begun))
    }
}

#[allow(clippy::disallowed_methods, reason = "a time limit of an answer is one by the wall clock")]
fn now() -> Instant {
    Instant::now()
}

/// Where questions go and answers come from.
enum Ends {
    Process { child: Child, stdin: Option<ChildStdin>, stdout: ChildStdout, stderr: Option<ChildStderr> },
    Tcp(TcpStream),
    Unix(UnixStream),
}

/// A connection to a driving system.
pub struct Link {
    ends: Ends,
    /// Bytes to be written.
    to_write: Vec<u8>,
    written: usize,
    /// Room for what is read at once.
    chunk: Vec<u8>,
    /// Bytes that were read.
    read: Vec<u8>,
    /// How many bytes of `read` are taken.
    taken: usize,
    /// From the first that is not taken up to here, `read` has no end of a line.
    searched: usize,
    is_closed: bool,
    /// The process has ended, though its output is open.
    is_orphaned: bool,
    stderr: Vec<u8>,
    /// Standard error since [`Link::said`].
    said: Vec<u8>,
    /// Bytes of standard error since the episode began.
    flood_bytes: u64,
    /// The process was reaped and its group ended: its number may belong to another.
    is_ended: bool,
}

impl Link {
    /// Starts the program, or connects to it.
    ///
    /// # Errors
    /// Why that is not possible.
    pub fn open(settings: &ExternalSettings) -> Result<Link, Broken> {
        let problem = if settings.command.is_socket() { Problem::NotReached } else { Problem::NotStarted };
        Link::opened(settings).map_err(|detail| Broken { problem, detail })
    }

    fn opened(settings: &ExternalSettings) -> Result<Link, String> {
        let ends = match &settings.command {
            Target::Program(words) => start(words, settings)?,
            Target::Tcp(address) => {
                let limit = Duration::from_secs_f64(settings.timeouts.init_s);
                let mut places = address
                    .to_socket_addrs()
                    .map_err(|error| format!("`{address}` is no place to connect to: {error}"))?;
                let place = places.next().ok_or_else(|| format!("`{address}` names no host"))?;
                let socket = TcpStream::connect_timeout(&place, limit)
                    .map_err(|error| format!("nothing answers at `{address}`: {error}"))?;
                let ready = socket.set_nodelay(true).and_then(|()| socket.set_nonblocking(true));
                ready.map_err(|error| format!("the connection to `{address}` cannot be used: {error}"))?;
                Ends::Tcp(socket)
            }
            Target::Unix(path) => {
                let path = match &settings.working_directory {
                    Some(directory) => directory.join(path),
                    None => path.clone(),
                };
                let socket = UnixStream::connect(&path)
                    .map_err(|error| format!("nothing answers at `{}`: {error}", path.shown()))?;
                socket.set_nonblocking(true).map_err(|error| error.to_string())?;
                Ends::Unix(socket)
            }
        };
        Ok(Link {
            ends,
            to_write: Vec::new(),
            written: 0,
            read: Vec::new(),
            chunk: vec![0; CHUNK_BYTES],
            taken: 0,
            searched: 0,
            is_closed: false,
            is_orphaned: false,
            stderr: Vec::new(),
            said: Vec::new(),
            flood_bytes: 0,
            is_ended: false,
        })
    }

    /// Notes that an episode begins.
    pub fn begin_episode(&mut self) {
        self.flood_bytes = 0;
    }

    /// Writes as much as fits now; the rest goes with the next line that is waited for.
    pub fn send(&mut self, line: &str) {
        self.to_write.extend_from_slice(line.as_bytes());
        // A failed write is noticed when an answer is waited for.
        let _ = self.write();
    }

    /// The next line that is not empty, without its end.
    ///
    /// # Errors
    /// If it does not come before the deadline, is too long, or cannot come any more.
    pub fn line(&mut self, deadline: Deadline) -> Result<Vec<u8>, Broken> {
        loop {
            if let Some(line) = self.whole_line()? {
                return Ok(line);
            }
            if self.is_closed || self.is_orphaned {
                return Err(self.ended());
            }
            if self.flood_bytes > STDERR_BYTES_MAX {
                let detail = format!("more than {} MiB on standard error", STDERR_BYTES_MAX >> 20);
                return Err(Broken { problem: Problem::Stderr, detail });
            }
            let left = deadline.left();
            if left.is_zero() {
                return Err(Broken { problem: Problem::NoAnswer, detail: "no answer in time".to_owned() });
            }
            if !self.wait(left) && self.exit_within(0.0).is_some() {
                // Something that it started may hold its output open. All that the process wrote before it ended is
                // read by now.
                self.is_orphaned = true;
            }
        }
    }

    /// A whole line that was written before the question. An unfinished line is left.
    ///
    /// # Errors
    /// If it is too long.
    pub fn unasked(&mut self) -> Result<Option<Vec<u8>>, Broken> {
        self.read_all();
        self.whole_line()
    }

    /// Waits for a moment until something can be read or written, and does so. `false` if nothing could.
    fn wait(&mut self, at_most: Duration) -> bool {
        let wants_write = self.written < self.to_write.len();
        let millis = at_most.as_micros().div_ceil(1000).min(u128::from(ALIVE_MS)) as u16;
        let mut fds: Vec<PollFd> = Vec::with_capacity(3);
        let out = if wants_write { PollFlags::POLLOUT } else { PollFlags::empty() };
        match &self.ends {
            Ends::Process { stdin, stdout, stderr, .. } => {
                fds.push(PollFd::new(stdout.as_fd(), PollFlags::POLLIN));
                fds.extend(stderr.as_ref().map(|pipe| PollFd::new(pipe.as_fd(), PollFlags::POLLIN)));
                let stdin = stdin.as_ref().filter(|_| wants_write);
                fds.extend(stdin.map(|pipe| PollFd::new(pipe.as_fd(), out)));
            }
            Ends::Tcp(socket) => fds.push(PollFd::new(socket.as_fd(), PollFlags::POLLIN | out)),
            Ends::Unix(socket) => fds.push(PollFd::new(socket.as_fd(), PollFlags::POLLIN | out)),
        }
        // An interrupted wait is a short wait.
        let is_ready = poll(&mut fds, PollTimeout::from(millis)).is_ok_and(|ready| ready > 0);
        drop(fds);
        if wants_write && self.write().is_err() {
            self.to_write.clear();
            self.written = 0;
        }
        self.read_all();
        is_ready
    }

    fn write(&mut self) -> std::io::Result<()> {
        while self.written < self.to_write.len() {
            let rest = &self.to_write[self.written..];
            let result = match &mut self.ends {
                Ends::Process { stdin: Some(stdin), .. } => stdin.write(rest),
                Ends::Process { stdin: None, .. } => return Ok(()),
                Ends::Tcp(socket) => socket.write(rest),
                Ends::Unix(socket) => socket.write(rest),
            };
            match result {
                Ok(count) => self.written += count,
                Err(error) if error.kind() == ErrorKind::WouldBlock => return Ok(()),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        self.to_write.clear();
        self.written = 0;
        Ok(())
    }

    /// Reads what is there: of the answers no more than a line and a half, of standard error all.
    fn read_all(&mut self) {
        let chunk = &mut self.chunk[..];
        if let Ends::Process { stderr, .. } = &mut self.ends
            && let Some(pipe) = stderr
        {
            loop {
                match pipe.read(chunk) {
                    Ok(0) => {
                        *stderr = None;
                        break;
                    }
                    Ok(count) => {
                        self.flood_bytes += count as u64;
                        self.stderr.extend_from_slice(&chunk[..count]);
                        let room = STDERR_BYTES_KEPT.saturating_sub(self.said.len());
                        self.said.extend_from_slice(&chunk[..count.min(room)]);
                        if self.stderr.len() > 2 * STDERR_BYTES_KEPT {
                            self.stderr.drain(..self.stderr.len() - STDERR_BYTES_KEPT);
                        }
                        // A program that writes faster than this reads must not keep it here.
                        if self.flood_bytes > STDERR_BYTES_MAX {
                            break;
                        }
                    }
                    Err(error) if error.kind() == ErrorKind::Interrupted => {}
                    Err(_) => break,
                }
            }
        }
        self.read.drain(..self.taken);
        self.searched -= self.taken;
        self.taken = 0;
        while self.read.len() <= LINE_BYTES_MAX && !self.is_closed {
            let result = match &mut self.ends {
                Ends::Process { stdout, .. } => stdout.read(chunk),
                Ends::Tcp(socket) => socket.read(chunk),
                Ends::Unix(socket) => socket.read(chunk),
            };
            match result {
                Ok(0) => self.is_closed = true,
                Ok(count) => {
                    self.read.extend_from_slice(&chunk[..count]);
                    if self.read[self.searched..].contains(&b'\n') {
                        break;
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => self.is_closed = true,
            }
        }
    }

    /// The first whole line of what was read that is not empty, without its end.
    fn whole_line(&mut self) -> Result<Option<Vec<u8>>, Broken> {
        loop {
            let end = self.read[self.searched..].iter().position(|byte| *byte == b'\n');
            let end = end.map(|end| self.searched + end);
            if end.unwrap_or(self.read.len()) - self.taken > LINE_BYTES_MAX {
                let detail = "a line of more than 1 MiB".to_owned();
                return Err(Broken { problem: Problem::TooLong, detail });
            }
            let Some(end) = end else {
                self.searched = self.read.len();
                return Ok(None);
            };
            let line = &self.read[self.taken..end];
            let line = (!line.iter().all(u8::is_ascii_whitespace)).then(|| line.to_vec());
            (self.taken, self.searched) = (end + 1, end + 1);
            if line.is_some() {
                return Ok(line);
            }
        }
    }

    /// Why nothing more comes.
    fn ended(&mut self) -> Broken {
        match self.exit_within(ENDING_S) {
            Some(_) => Broken { problem: Problem::Exited, detail: "the process ended".to_owned() },
            None if matches!(self.ends, Ends::Process { .. }) => {
                Broken { problem: Problem::Closed, detail: "it closed its standard output".to_owned() }
            }
            None => Broken { problem: Problem::Closed, detail: "it closed the connection".to_owned() },
        }
    }

    /// The exit status, in words, of a process that ends by itself within a time.
    pub fn exit_within(&mut self, limit_s: f64) -> Option<String> {
        let deadline = Deadline::after(limit_s);
        loop {
            let Ends::Process { child, .. } = &mut self.ends else { return None };
            if let Ok(Some(status)) = child.try_wait() {
                self.read_all();
                return Some(status_text(status));
            }
            let left = deadline.left();
            if left.is_zero() {
                return None;
            }
            // Standard error is read on, so that a process that writes there can end.
            self.read_all();
            std::thread::sleep(left.min(Duration::from_millis(2)));
        }
    }

    /// Standard error since this was asked last, at most the first 64 KiB of it, as text.
    pub fn said(&mut self) -> String {
        if self.said.is_empty() {
            return String::new();
        }
        harmless(&String::from_utf8_lossy(&core::mem::take(&mut self.said)))
    }

    /// The end of standard error as text.
    pub fn stderr(&mut self) -> String {
        self.read_all();
        let kept = &self.stderr[self.stderr.len().saturating_sub(STDERR_BYTES_KEPT)..];
        harmless(&String::from_utf8_lossy(kept))
    }

    /// Says that no more comes, and waits for the process to end; then ends it.
    ///
    /// # Errors
    /// How it ended, if not by itself with status 0. A socket always ends well.
    pub fn close(&mut self, line: &str, limit_s: f64) -> Result<(), String> {
        self.send(line);
        // Bytes that the pipe does not hold are lost; the end of the input says the same.
        match &mut self.ends {
            Ends::Process { stdin, .. } => *stdin = None,
            Ends::Tcp(socket) => drop(socket.shutdown(std::net::Shutdown::Both)),
            Ends::Unix(socket) => drop(socket.shutdown(std::net::Shutdown::Both)),
        }
        if !matches!(self.ends, Ends::Process { .. }) {
            return Ok(());
        }
        let ended = self.exit_within(limit_s);
        if ended.is_none() {
            self.signal(Signal::SIGTERM);
            self.exit_within(TERM_S);
        }
        self.kill();
        match ended {
            Some(status) if status == status_text(ExitStatus::from_raw(0)) => Ok(()),
            Some(status) => Err(format!("it ended with {status}")),
            None => Err(format!("it did not end within {limit_s} s")),
        }
    }

    /// Ends the process group at once and reaps the process. One that cannot be ended, as another user's, is left after
    /// some seconds.
    pub fn kill(&mut self) {
        if self.is_ended {
            return;
        }
        self.is_ended = true;
        self.signal(Signal::SIGKILL);
        if let Ends::Process { child, stdin, .. } = &mut self.ends {
            // It may have left its group; and one that no signal reaches may end with its input.
            let _ = child.kill();
            *stdin = None;
            // Forgotten before it is reaped: afterwards its number may belong to another.
            if let Ok(id) = i32::try_from(child.id()) {
                groups().remove(&id);
            }
            // Its end takes milliseconds, if a signal reaches it.
            let mut looks = 0;
            while matches!(child.try_wait(), Ok(None)) && looks < REAP_LOOKS {
                std::thread::sleep(Duration::from_millis(1));
                looks += 1;
            }
        }
    }

    /// To the whole group, which the process leads: also to what it started.
    fn signal(&self, signal: Signal) {
        if let Ends::Process { child, .. } = &self.ends
            && let Ok(id) = i32::try_from(child.id())
        {
            // It fails only if no process of the group is left.
            let _ = killpg(Pid::from_raw(id), signal);
        }
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        self.kill();
    }
}

fn start(words: &[String], settings: &ExternalSettings) -> Result<Ends, String> {
    let mut command = Command::new(&words[0]);
    command.args(&words[1..]).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    // Number libraries that use every core, and hashes with a new seed each time, make two runs differ.
    command.env("OMP_NUM_THREADS", "1").env("PYTHONHASHSEED", "0");
    command.envs(&settings.env).process_group(0);
    if let Some(directory) = &settings.working_directory {
        if !directory.is_dir() {
            return Err(format!("its working directory `{}` is no folder", directory.shown()));
        }
        command.current_dir(directory);
    }
    let spawned = with_no_signal_blocked(|| command.spawn());
    let mut child = spawned.map_err(|error| {
        let hint =
            if error.kind() == ErrorKind::PermissionDenied { "; `chmod +x` makes it a program" } else { "" };
        format!("`{}` cannot be started: {error}{hint}", words[0])
    })?;
    groups().extend(i32::try_from(child.id()));
    let (stdin, stdout, stderr) = (child.stdin.take(), child.stdout.take(), child.stderr.take());
    let stdout = stdout.expect("it was asked for");
    let fds: [Option<BorrowedFd>; 3] =
        [stdin.as_ref().map(AsFd::as_fd), Some(stdout.as_fd()), stderr.as_ref().map(AsFd::as_fd)];
    for fd in fds.into_iter().flatten() {
        fcntl(fd, FcntlArg::F_SETFL(OFlag::O_NONBLOCK)).map_err(|error| format!("its pipes: {error}"))?;
    }
    Ok(Ends::Process { child, stdin, stdout, stderr })
}

/// A child inherits which signals are blocked: avastra waits for SIGTERM in one thread and blocks it in the others, and a
/// driving system must still end by it.
fn with_no_signal_blocked<T>(spawn: impl FnOnce() -> T) -> T {
    let before = SigSet::thread_get_mask();
    // Both fail only for masks that do not exist.
    let _ = SigSet::empty().thread_set_mask();
    let spawned = spawn();
    let _ = before.and_then(|before| before.thread_set_mask());
    spawned
}

fn status_text(status: ExitStatus) -> String {
    match (status.code(), status.signal()) {
        (Some(code), _) => format!("exit status {code}"),
        (None, Some(number)) => match Signal::try_from(number) {
            Ok(signal) => format!("signal {signal}"),
            Err(_) => format!("signal {number}"),
        },
        (None, None) => "no status".to_owned(),
    }
}
