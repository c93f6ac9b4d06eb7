//! A driving system outside this program, for many episodes at once: its processes, and what it is known to answer.

use std::collections::{BTreeMap, VecDeque};
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use avastra_road::RoadMap;

use super::finding::{Failure, Problem};
use super::message::{Init, Question};
use super::question;
use super::record::{Attached, Conversation, Key, Outcome};
use super::session::{Identity, Session};
use super::settings::ExternalSettings;
use super::thinking::{Thinking, Thoughts};

/// Most memory for answers that are kept, bytes: an episode of trajectories with a thousand points has some 30 MB.
const KNOWN_BYTES_MAX: usize = 128 << 20;
/// Most maps whose message is kept.
const MAPS_MAX: usize = 16;
/// A program is given up after this many failures in a row to start it or to connect to it, because each may take as long as
/// the limit of `init`.
const ATTEMPTS_MAX: u32 = 3;

/// An external driving system.
pub struct Program {
    settings: ExternalSettings,
    init: Init,
    /// Whether processes may be started: recorded answers alone need none, and what a file names is never run.
    may_start: bool,
    identity: OnceLock<Identity>,
    idle: Mutex<Vec<Session>>,
    known: Mutex<Known>,
    maps: Mutex<Vec<Arc<MapLine>>>,
    missed: AtomicU64,
    cut_off: AtomicU64,
    /// Failures, and the last of them.
    failed: Mutex<(u64, Option<Arc<Failure>>)>,
    unreached: Mutex<Unreached>,
    thoughts: Mutex<Thoughts>,
    /// How its answers differed when it was asked the same again, if they ever did.
    otherwise: OnceLock<String>,
}

/// Failures in a row to start a program, or to connect to it, and the last of them.
#[derive(Default)]
struct Unreached {
    times: u32,
    last: Option<Failure>,
}

/// Answers by what was asked, so that an episode that is played again needs no process; the oldest go first.
#[derive(Default)]
struct Known {
    answers: BTreeMap<Key, Outcome>,
    order: VecDeque<Key>,
    bytes: usize,
}

/// The message about a map.
pub(super) struct MapLine {
    map: Arc<RoadMap>,
    pub line: String,
    /// The key that every conversation on the map begins with.
    pub key: Key,
}

impl core::fmt::Debug for Program {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Program").field("settings", &self.settings).finish_non_exhaustive()
    }
}

impl Program {
    /// A driving system that is started when it is needed.
    pub fn new(settings: ExternalSettings) -> Arc<Program> {
        Program::with(settings, None, true)
    }

    /// A driving system that is known by recorded answers only, and never started.
    pub fn recorded(attached: Attached, answers: Vec<(Key, Outcome)>) -> Arc<Program> {
        let program = Program::with(attached.settings, attached.identity, false);
        for (key, outcome) in answers {
            program.learn(key, outcome);
        }
        program
    }

    fn with(settings: ExternalSettings, identity: Option<Identity>, may_start: bool) -> Arc<Program> {
        Arc::new(Program {
            init: question::init(&settings),
            settings,
            may_start,
            identity: identity.map_or_else(OnceLock::new, OnceLock::from),
            idle: Mutex::default(),
            known: Mutex::default(),
            maps: Mutex::default(),
            missed: AtomicU64::new(0),
            cut_off: AtomicU64::new(0),
            failed: Mutex::default(),
            unreached: Mutex::default(),
            thoughts: Mutex::default(),
            otherwise: OnceLock::new(),
        })
    }

    /// Starts it once, to see that it can be.
    ///
    /// # Errors
    /// Why it is of no use.
    pub fn start(&self) -> Result<Identity, Failure> {
        let session = self.session(None)?;
        let identity = session.identity.clone();
        self.give_back(session);
        Ok(identity)
    }

    /// Sees whether a socket serves as many connections at once as there are jobs; processes are started as needed.
    ///
    /// # Errors
    /// Why it does not.
    pub fn reserve(&self, jobs: usize) -> Result<(), Failure> {
        if self.may_start && self.settings.command.is_socket() {
            let missing = jobs.saturating_sub(locked(&self.idle).len());
            let opened = (0..missing).map(|_| self.opened()).collect::<Result<Vec<_>, _>>()?;
            locked(&self.idle).extend(opened);
        }
        Ok(())
    }

    /// Notes that a step was not answered in time, in mode `hold`.
    pub(super) fn miss(&self) {
        self.missed.fetch_add(1, Ordering::Relaxed);
    }

    /// Steps that were not answered in time, in mode `hold`, since avastra was started.
    pub fn missed(&self) -> u64 {
        self.missed.load(Ordering::Relaxed)
    }

    /// Notes how long a process took for the answer to a step, s.
    pub(super) fn thought(&self, took_s: f64) {
        let ExternalSettings { period_s, timeouts, .. } = &self.settings;
        locked(&self.thoughts).add(took_s, *period_s, timeouts.step_s);
    }

    /// How long it thought, since avastra was started; `None` if it was not asked.
    pub fn thinking(&self) -> Option<Thinking> {
        locked(&self.thoughts).told()
    }

    /// Notes that an answer asked for more than any vehicle can do.
    pub(super) fn cut_off(&self) {
        self.cut_off.fetch_add(1, Ordering::Relaxed);
    }

    /// Answers that asked for more than any vehicle can do, since avastra was started.
    pub fn extreme_answers(&self) -> u64 {
        self.cut_off.load(Ordering::Relaxed)
    }

    /// Notes that it failed.
    pub(super) fn fail(&self, failure: &Arc<Failure>) {
        let mut failed = locked(&self.failed);
        *failed = (failed.0 + 1, Some(Arc::clone(failure)));
    }

    /// How often it failed since avastra was started, and the last failure.
    pub fn failed(&self) -> (u64, Option<Arc<Failure>>) {
        locked(&self.failed).clone()
    }

    /// If it was given up, the last of the failures in a row to start it or to connect to it.
    pub fn given_up(&self) -> Option<Failure> {
        let unreached = locked(&self.unreached);
        unreached.last.clone().filter(|_| unreached.times >= ATTEMPTS_MAX)
    }

    /// Tests a program that says it is deterministic: plays an episode `again` without the recorded answers, and notes if the
    /// answers differ from the `first` ones. Returns whether the test was made: it is not if the program failed in the
    /// episode or ever answered too late.
    pub fn spot_check(
        &self,
        first: &Conversation,
        again: impl FnOnce() -> Option<Arc<Conversation>>,
    ) -> bool {
        let is_due = self.may_start
            && self.is_deterministic()
            && self.missed() == 0
            && self.given_up().is_none()
            && !matches!(first.exchanges.last(), None | Some((_, Outcome::Failed(_))));
        if !is_due {
            return false;
        }
        self.forget();
        let found = again().and_then(|again| first.difference(&again));
        if let Some((_, found)) = found
            && self.missed() == 0
        {
            self.otherwise.get_or_init(|| found);
        }
        true
    }

    /// Whether it says that it is deterministic, and was never found to be otherwise.
    pub fn is_deterministic(&self) -> bool {
        self.attached().is_deterministic() && self.otherwise().is_none()
    }

    /// How its answers differed when it was asked the same again, though it says that it is deterministic.
    pub fn otherwise(&self) -> Option<&str> {
        self.otherwise.get().map(String::as_str)
    }

    pub fn settings(&self) -> &ExternalSettings {
        &self.settings
    }

    /// Whether other episodes can be driven than those that were recorded.
    pub fn can_start(&self) -> bool {
        self.may_start
    }

    /// The program's identity, as far as it was asked for, and its settings.
    pub fn attached(&self) -> Attached {
        let identity = self.identity.get().cloned();
        Attached { identity, settings: self.settings.clone(), is_recorded: false }
    }

    /// What the program says of itself. It is started once to find out, if it never was; if it cannot be, the first question says why.
    pub(super) fn identify(&self) -> Option<&Identity> {
        if self.identity.get().is_none() && self.may_start {
            let _ = self.start();
        }
        self.identity.get()
    }

    /// A process that no episode uses; one that has the map, if there is any.
    pub(super) fn session(&self, map: Option<Key>) -> Result<Session, Failure> {
        let mut idle = locked(&self.idle);
        let fits = idle.iter().position(|session| session.map == map.map(|key| key.0));
        if let Some(index) = fits.or_else(|| idle.len().checked_sub(1)) {
            return Ok(idle.swap_remove(index));
        }
        drop(idle);
        self.opened()
    }

    /// A new process, or a new connection.
    fn opened(&self) -> Result<Session, Failure> {
        if let Some(last) = self.given_up() {
            let detail =
                format!("given up after {ATTEMPTS_MAX} failures in a row, the last: {}", last.in_words());
            return Err(Failure::new(Problem::GivenUp, "start", detail));
        }
        let opened = Session::open(&self.settings, &self.init);
        {
            let mut unreached = locked(&self.unreached);
            unreached.last = opened.as_ref().err().cloned();
            unreached.times = if opened.is_ok() { 0 } else { unreached.times + 1 };
        }
        let mut session = opened?;
        let first = self.identity.get_or_init(|| session.identity.clone());
        if *first != session.identity {
            let detail =
                format!("it was {}, and now says that it is {}", first.text(), session.identity.text());
            return Err(session.otherwise("init".to_owned(), detail));
        }
        Ok(session)
    }

    pub(super) fn give_back(&self, session: Session) {
        locked(&self.idle).push(session);
    }

    /// Ends all processes that no episode uses. A program that was given up may be tried again.
    ///
    /// # Errors
    /// How the first that did not end by itself with status 0 ended.
    pub fn close(&self) -> Result<(), String> {
        let idle: Vec<Session> = core::mem::take(&mut *locked(&self.idle));
        *locked(&self.unreached) = Unreached::default();
        let limit_s = self.settings.timeouts.close_s;
        // Each is closed, whatever became of the ones before.
        idle.into_iter().map(|session| session.close(limit_s)).fold(Ok(()), Result::and)
    }

    /// Forgets all answers, so that the next episodes are asked anew.
    pub fn forget(&self) {
        *locked(&self.known) = Known::default();
    }

    pub(super) fn known(&self, key: Key) -> Option<Outcome> {
        locked(&self.known).answers.get(&key).cloned()
    }

    pub(super) fn learn(&self, key: Key, outcome: Outcome) {
        let mut known = locked(&self.known);
        known.bytes += outcome.bytes();
        match known.answers.insert(key, outcome) {
            Some(before) => known.bytes -= before.bytes(),
            None => known.order.push_back(key),
        }
        while known.bytes > KNOWN_BYTES_MAX
            && let Some(oldest) = known.order.pop_front()
            && let Some(gone) = known.answers.remove(&oldest)
        {
            known.bytes -= gone.bytes();
        }
    }

    /// The message about a map. Conversations do not depend on where its file lies.
    pub(super) fn map_line(&self, map: &Arc<RoadMap>) -> Arc<MapLine> {
        let mut maps = locked(&self.maps);
        if let Some(found) = maps.iter().find(|known| Arc::ptr_eq(&known.map, map)) {
            return Arc::clone(found);
        }
        let file =
            map.file.as_ref().map(|file| std::path::absolute(file).unwrap_or_else(|_| PathBuf::from(file)));
        let essence = Question::Map(question::map(map, None)).line();
        let asked = Question::Init(Init { simulator: String::new(), ..self.init.clone() }).line();
        let made = Arc::new(MapLine {
            line: Question::Map(question::map(map, file.as_deref())).line(),
            key: Key::new(&[asked.as_bytes(), essence.as_bytes()]),
            map: Arc::clone(map),
        });
        if maps.len() >= MAPS_MAX {
            maps.remove(0);
        }
        maps.push(Arc::clone(&made));
        made
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        // How it ends is of no interest any more.
        let _ = self.close();
    }
}

/// The data behind the lock are whole, even if a thread panicked while it held the lock.
fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
