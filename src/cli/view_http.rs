//! One request and its answer over HTTP/1.1: GET without a body, then the connection ends.

use std::io::{ErrorKind, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

/// Bytes of a request; a longer one is refused. A condition fits many times.
const REQUEST_BYTES: usize = 16 << 10;
const HEADERS: usize = 64;
/// Time for a request to arrive. A connection without one holds a place that others wait for.
const ARRIVAL: Duration = Duration::from_secs(2);
/// Time for an answer to be taken.
const PATIENCE: Duration = Duration::from_secs(60);
/// Bytes sent before the time is looked at.
const SENT_BYTES: usize = 256 << 10;
/// Time and bytes that a refused client may still send before the connection ends, so that it reads why.
const DRAIN: Duration = Duration::from_millis(200);
const DRAIN_BYTES: usize = 1 << 20;
/// Random bytes of a token, 192 bits.
const TOKEN_BYTES: usize = 24;
/// Header with the token.
pub const TOKEN_HEADER: &str = "X-Tetdb-Token";

/// A request that is well formed and meant for this server.
#[derive(Debug)]
pub struct Request {
    pub path: String,
    /// Decoded parameters, in their order.
    pub parameters: Vec<(String, String)>,
    /// The token of the header.
    pub token: Option<String>,
}

/// An answer.
#[derive(Debug)]
pub struct Answer {
    pub status: u16,
    pub kind: &'static str,
    pub body: Vec<u8>,
    /// For a page, the nonce of its scripts and styles.
    pub nonce: Option<String>,
}

impl Answer {
    /// A refusal with a sentence.
    pub fn refusal(status: u16, why: impl Into<String>) -> Self {
        let body = serde_json::json!({ "error": { "message": why.into() } });
        Self::json(status, &body)
    }

    pub fn json(status: u16, body: &serde_json::Value) -> Self {
        let body = body.to_string().into_bytes();
        Self { status, kind: "application/json; charset=utf-8", body, nonce: None }
    }

    pub fn bytes(body: Vec<u8>) -> Self {
        Self { status: 200, kind: "application/octet-stream", body, nonce: None }
    }
}

/// Reads a request. Errors: the answer that refuses it; `None` if the client is gone.
pub fn read(stream: &mut TcpStream, port: u16) -> Result<Request, Option<Answer>> {
    let deadline = Instant::now() + ARRIVAL;
    let mut bytes = Vec::new();
    loop {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Err(Some(Answer::refusal(408, "the request did not arrive in time")));
        }
        stream.set_read_timeout(Some(left)).map_err(|_| None)?;
        let mut piece = [0; 4096];
        match stream.read(&mut piece) {
            Ok(0) => return Err(None),
            Ok(n) => bytes.extend_from_slice(&piece[..n]),
            Err(e) if e.kind() == ErrorKind::Interrupted => continue,
            Err(e) if matches!(e.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => continue,
            Err(_) => return Err(None),
        }
        if let Some(request) = parse(&bytes, port).map_err(Some)? {
            return Ok(request);
        }
        if bytes.len() > REQUEST_BYTES {
            let why = format!("a request has at most {REQUEST_BYTES} bytes");
            return Err(Some(Answer::refusal(431, why)));
        }
    }
}

/// Parses a request; `None` if more of it is to come. Errors: the answer that refuses it.
fn parse(bytes: &[u8], port: u16) -> Result<Option<Request>, Answer> {
    let mut headers = [httparse::EMPTY_HEADER; HEADERS];
    let mut request = httparse::Request::new(&mut headers);
    match request.parse(bytes) {
        Ok(status) if status.is_partial() => return Ok(None),
        Ok(_) => {}
        Err(httparse::Error::TooManyHeaders) => {
            return Err(Answer::refusal(431, format!("a request has at most {HEADERS} headers")));
        }
        Err(error) => {
            return Err(Answer::refusal(400, format!("this is no request over HTTP/1: {error}")));
        }
    }
    let values = |name: &str| {
        let own = request.headers.iter().filter(move |h| h.name.eq_ignore_ascii_case(name));
        own.map(|h| h.value.trim_ascii()).collect::<Vec<&[u8]>>()
    };
    // A page of another site whose name leads to this machine has another host.
    let is_here = |host: &[u8]| {
        let named = |name: &str| format!("{name}:{port}").as_bytes().eq_ignore_ascii_case(host);
        named("127.0.0.1") || named("localhost")
    };
    if !matches!(values("Host")[..], [host] if is_here(host)) {
        let why = format!("the host of a request is 127.0.0.1:{port} or localhost:{port}");
        return Err(Answer::refusal(403, why));
    }
    if request.method != Some("GET") {
        return Err(Answer::refusal(405, "only GET is answered"));
    }
    let has_body = !values("Transfer-Encoding").is_empty()
        || values("Content-Length").iter().any(|length| *length != b"0");
    if has_body {
        return Err(Answer::refusal(400, "a request has no body"));
    }
    let target = request.path.unwrap_or_default();
    let (path, query) = target.split_once('?').unwrap_or((target, ""));
    let token = match values(TOKEN_HEADER)[..] {
        [token] => Some(String::from_utf8_lossy(token).into_owned()),
        _ => None,
    };
    let parameters = form_urlencoded::parse(query.as_bytes()).into_owned().collect();
    Ok(Some(Request { path: path.to_owned(), parameters, token }))
}

/// Sends an answer and ends the connection. A client that is gone is no error.
pub fn send(stream: &mut TcpStream, answer: &Answer) {
    let reason = match answer.status {
        200 => "OK",
        400 => "Bad Request",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        431 => "Request Header Fields Too Large",
        503 => "Service Unavailable",
        _ => "Internal Server Error",
    };
    let source = match &answer.nonce {
        Some(nonce) => format!(
            "; script-src 'nonce-{nonce}'; style-src 'nonce-{nonce}'; connect-src 'self'; img-src data:"
        ),
        None => String::new(),
    };
    let allow = if answer.status == 405 { "Allow: GET\r\n" } else { "" };
    let head = format!(
        "HTTP/1.1 {} {reason}\r\nContent-Type: {}\r\nContent-Length: {}\r\nConnection: close\r\n{allow}\
         Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
         Cross-Origin-Opener-Policy: same-origin\r\nCross-Origin-Resource-Policy: same-origin\r\n\
         Content-Security-Policy: default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'{source}\r\n\r\n",
        answer.status,
        answer.kind,
        answer.body.len(),
    );
    let deadline = Instant::now() + PATIENCE;
    let mut write = |bytes: &[u8]| {
        let left = deadline.saturating_duration_since(Instant::now()).max(Duration::from_millis(1));
        stream.set_write_timeout(Some(left)).and_then(|()| stream.write_all(bytes))
    };
    let sent = write(head.as_bytes())
        .and_then(|()| answer.body.chunks(SENT_BYTES).try_for_each(&mut write))
        .and_then(|()| stream.shutdown(Shutdown::Write));
    if sent.is_ok() && answer.status != 200 {
        drain(stream);
    }
}

/// Reads what a refused client still sends: a connection that ends before would take the answer with it.
fn drain(stream: &mut TcpStream) {
    let deadline = Instant::now() + DRAIN;
    let (mut piece, mut n_read) = ([0; 4096], 0);
    while n_read < DRAIN_BYTES {
        let left = deadline.saturating_duration_since(Instant::now());
        if left.is_zero() || stream.set_read_timeout(Some(left)).is_err() {
            return;
        }
        match stream.read(&mut piece) {
            Ok(0) | Err(_) => return,
            Ok(n) => n_read += n,
        }
    }
}

/// Returns whether the client has closed the connection: then nobody waits for the answer.
pub fn is_gone(stream: &TcpStream) -> bool {
    let looked = stream.set_nonblocking(true).and_then(|()| stream.peek(&mut [0]));
    let is_open = match looked {
        Ok(n) => n > 0,
        Err(e) => e.kind() == ErrorKind::WouldBlock,
    };
    stream.set_nonblocking(false).is_err() || !is_open
}

/// A random number of the system in hexadecimal digits. Errors: the system has none.
pub fn random_token() -> std::io::Result<String> {
    let mut bytes = [0; TOKEN_BYTES];
    getrandom::fill(&mut bytes)?;
    Ok(bytes.iter().map(|byte| format!("{byte:02x}")).collect())
}
