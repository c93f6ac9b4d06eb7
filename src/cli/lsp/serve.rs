//! The process: it reads messages, answers requests, and publishes mistakes when no message waits.

use std::collections::VecDeque;
use std::io::BufReader;
use std::sync::mpsc;
use std::sync::mpsc::Receiver;

use serde_json::Value;

use crate::cli::error::Failure;

use super::server::{Server, error_reply, parsed};
use super::transport;
use super::transport::TransportError;

/// Error code of LSP for a request that the editor has cancelled.
const REQUEST_CANCELLED: i64 = -32800;

/// What the reading thread hands over.
type Incoming = Result<Vec<u8>, TransportError>;

/// Serves until the editor sends `exit` or closes the input.
///
/// # Errors
/// If the input is not the protocol, or ends without `shutdown`.
pub fn serve() -> Result<(), Failure> {
    let (sender, receiver) = mpsc::channel();
    // The thread ends with the process, because a read from stdin cannot be interrupted.
    std::thread::spawn(move || {
        let mut input = BufReader::new(std::io::stdin());
        while let Some(message) = transport::read(&mut input).transpose() {
            let is_last = message.is_err();
            if sender.send(message).is_err() || is_last {
                break;
            }
        }
    });
    let mut server = Server::default();
    let mut waiting: VecDeque<Value> = VecDeque::new();
    loop {
        let ended = take(&receiver, &mut waiting, &mut server)?;
        let Some(message) = waiting.pop_front() else {
            if ended {
                break;
            }
            send(server.publish());
            continue;
        };
        send(server.receive(&message));
        if let Some(in_order) = server.exit() {
            return if in_order { Ok(()) } else { Err(Failure::usage("`exit` came without `shutdown`")) };
        }
    }
    match server.is_shut_down() {
        true => Ok(()),
        false => Err(Failure::usage("the input ended without `shutdown`")),
    }
}

/// Queues every message that has arrived, and waits for one if there is nothing else to do. Returns whether
/// the input has ended.
fn take(
    receiver: &Receiver<Incoming>,
    waiting: &mut VecDeque<Value>,
    server: &mut Server,
) -> Result<bool, Failure> {
    loop {
        let idle = waiting.is_empty() && !server.has_news();
        let next = match idle {
            true => receiver.recv().map_err(|_| true),
            false => receiver.try_recv().map_err(|error| error == mpsc::TryRecvError::Disconnected),
        };
        let body = match next {
            Ok(body) => body.map_err(|error| Failure::usage(error.to_string()))?,
            Err(ended) => return Ok(ended),
        };
        match parsed(&body) {
            Err(reply) => send(vec![reply]),
            Ok(message) => match cancelled(&message) {
                Some(id) => cancel(id, waiting),
                None => waiting.push_back(message),
            },
        }
    }
}

/// The request that a `$/cancelRequest` is about.
fn cancelled(message: &Value) -> Option<&Value> {
    (message["method"] == "$/cancelRequest").then(|| &message["params"]["id"])
}

/// Answers a waiting request as cancelled. A request that is done has its answer already.
fn cancel(id: &Value, waiting: &mut VecDeque<Value>) {
    let is_meant = |message: &Value| message["method"].is_string() && message.get("id") == Some(id);
    if let Some(place) = waiting.iter().position(is_meant) {
        waiting.remove(place);
        send(vec![error_reply(id, REQUEST_CANCELLED, "cancelled")]);
    }
}

/// Writes a message. A failure is ignored: the end of the input follows and ends the server.
fn send(messages: Vec<Value>) {
    let mut output = std::io::stdout().lock();
    for message in messages {
        let _ = transport::write(&mut output, &message);
    }
}
