//! The server of `view` answers its own page alone, and with what `query` finds.
//!
//! Why: other programs and other pages of the browser reach its port too, and what it draws must be the mesh.
//! How: requests are written byte by byte. `tests/view.py` looks at the page in a browser.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

use serde_json::Value;

use super::place::Place;

/// A running server, killed with the test.
struct Server {
    child: Child,
    port: u16,
    token: String,
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// An answer: status, headers and body.
struct Reply {
    status: u16,
    head: String,
    body: Vec<u8>,
}

impl Reply {
    fn json(&self) -> Value {
        serde_json::from_slice(&self.body).expect("JSON")
    }

    /// The sentence of a refusal.
    fn sentence(&self) -> String {
        self.json()["error"]["message"].as_str().expect("a sentence").to_owned()
    }

    /// The line before packed triangles.
    fn line(&self) -> Value {
        let end = self.body.iter().position(|&b| b == b'\n').expect("a line");
        serde_json::from_slice(&self.body[..end]).expect("JSON")
    }

    /// The values behind packed triangles.
    fn values(&self) -> Vec<f32> {
        let n = self.line()["values"].as_u64().expect("a number") as usize;
        let bytes = &self.body[self.body.len() - 4 * n..];
        bytes.chunks(4).map(|b| f32::from_le_bytes(b.try_into().expect("four"))).collect()
    }
}

impl Server {
    fn start(place: &Place, words: &str) -> Self {
        let words: Vec<&str> = ["view", "--no-open"].into_iter().chain(words.split(' ')).collect();
        let mut child = place.command(&words).spawn().expect("the program starts");
        let mut line = String::new();
        let stdout = child.stdout.take().expect("it is piped");
        BufReader::new(stdout).read_line(&mut line).expect("a line");
        let rest = line.trim().strip_prefix("http://127.0.0.1:").expect("an address");
        let (port, token) = rest.split_once("/?token=").expect("a token");
        let port = port.parse().expect("a port");
        Self { child, port, token: token.to_owned() }
    }

    /// Sends bytes; the answer to them.
    fn send(&self, bytes: &[u8]) -> Reply {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("it listens");
        // A server that refuses early may not read all.
        let _ = stream.write_all(bytes);
        let mut all = Vec::new();
        stream.read_to_end(&mut all).expect("an answer");
        let end = all.windows(4).position(|w| w == b"\r\n\r\n").expect("a head");
        let head = String::from_utf8_lossy(&all[..end]).into_owned();
        let status = head.split(' ').nth(1).and_then(|s| s.parse().ok()).expect("a status");
        Reply { status, head, body: all[end + 4..].to_vec() }
    }

    /// Sends a request with these lines behind its first one.
    fn ask(&self, first: &str, lines: &[&str]) -> Reply {
        let lines: String = lines.iter().map(|line| format!("{line}\r\n")).collect();
        self.send(format!("{first} HTTP/1.1\r\n{lines}\r\n").as_bytes())
    }

    /// Asks as the page does.
    fn get(&self, path: &str) -> Reply {
        let (host, token) = (self.host(), format!("X-Tetdb-Token: {}", self.token));
        self.ask(&format!("GET {path}"), &[&host, &token])
    }

    fn host(&self) -> String {
        format!("Host: 127.0.0.1:{}", self.port)
    }
}

fn place() -> Place {
    place_of("box,h=0.09")
}

fn place_of(sample: &str) -> Place {
    let place = Place::new();
    let line = format!("mesh sample:{sample} -o a.tetdb --subdomains 2 --no-verify");
    place.run_line(&line).succeeds();
    place.run_line("field a.tetdb add T --at vertices --from x+2*y").succeeds();
    place
}

#[test]
fn only_the_page_with_the_token_is_answered() {
    let place = place();
    let server = Server::start(&place, "a.tetdb");
    let (host, token) = (server.host(), format!("X-Tetdb-Token: {}", server.token));
    assert!(server.token.len() >= 32, "{}", server.token);

    let page = server.ask(&format!("GET /?token={}", server.token), &[&host]);
    assert_eq!(page.status, 200, "{}", page.head);
    for header in [
        "Content-Security-Policy: default-src 'none'",
        "X-Content-Type-Options: nosniff",
        "Referrer-Policy: no-referrer",
        "Cache-Control: no-store",
    ] {
        assert!(page.head.contains(header), "{}", page.head);
    }
    assert!(!page.head.contains("unsafe"), "{}", page.head);
    let text = String::from_utf8_lossy(&page.body).into_owned();
    assert!(text.contains(">a – tetdb<") && !text.contains("src=") && !text.contains("<script>"));

    let other = "0".repeat(server.token.len());
    let wrong = format!("X-Tetdb-Token: {other}");
    for (first, lines) in [
        ("GET /".to_owned(), vec![&host[..]]),
        ("GET /".to_owned(), vec![&host, &token]),
        (format!("GET /?token={other}"), vec![&host]),
        (format!("GET /?token={}&token={other}", server.token), vec![&host]),
        ("GET /boundary?share=0".to_owned(), vec![&host]),
        ("GET /boundary?share=0".to_owned(), vec![&host, &wrong]),
        ("GET /boundary?share=0".to_owned(), vec![&host, &token, &wrong]),
        (format!("GET /boundary?share=0&token={}", server.token), vec![&host]),
        ("GET /nowhere".to_owned(), vec![&host]),
    ] {
        let refused = server.ask(&first, &lines);
        assert_eq!(refused.status, 403, "{first} {lines:?}");
        assert!(refused.sentence().contains("token"), "{}", refused.sentence());
    }
    for host in [
        "Host: example.org".to_owned(),
        format!("Host: example.org:{}", server.port),
        format!("Host: 127.0.0.1:{}", server.port.wrapping_add(1)),
        "Host: 127.0.0.1".to_owned(),
        format!("Host: 127.0.0.1:{}.example.org", server.port),
        "X-Host: none".to_owned(),
        format!("{host}\r\n{host}"),
    ] {
        let refused = server.ask("GET /boundary?share=0", &[&host, &token]);
        assert_eq!(refused.status, 403, "{host}");
        assert!(refused.sentence().contains("host"), "{host}");
    }
    let named = format!("Host: localhost:{}", server.port);
    assert_eq!(server.ask("GET /boundary?share=0", &[&named, &token]).status, 200);
    for method in ["POST", "HEAD", "OPTIONS", "DELETE", "get"] {
        let refused = server.ask(&format!("{method} /boundary?share=0"), &[&host, &token]);
        assert_eq!(refused.status, 405, "{method}");
    }
    for path in ["/nowhere", "/../a.tetdb/catalog.redb", "/catalog.redb", "//", "/boundary/"] {
        assert_eq!(server.get(path).status, 404, "{path}");
    }
}

#[test]
fn broken_and_long_requests_are_refused() {
    let place = place();
    let mut server = Server::start(&place, "a.tetdb --memory 64MiB --threads 1");
    let (host, token) = (server.host(), format!("X-Tetdb-Token: {}", server.token));
    let long = format!("GET /pick?where={}", "x".repeat(40_000));
    assert_eq!(server.ask(&long, &[&host, &token]).status, 431);
    let many: Vec<String> = (0..200).map(|k| format!("A{k}: b")).collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    assert_eq!(server.ask("GET /", &many).status, 431);
    for bytes in [
        &b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n"[..],
        b"GET\r\n\r\n",
        b"GET / HTTP/2.0\r\n\r\n",
        b"GET /\0 HTTP/1.1\r\nHost: a\r\n\r\n",
    ] {
        assert_eq!(server.send(bytes).status, 400, "{bytes:?}");
    }
    for body in ["Content-Length: 5", "Transfer-Encoding: chunked", "Content-Length: x"] {
        assert_eq!(server.ask("GET /boundary?share=0", &[&host, &token, body]).status, 400);
    }
    // Clients that open a connection and say nothing, or leave, keep nobody from an answer.
    let silent: Vec<TcpStream> = (0..8)
        .map(|_| TcpStream::connect(("127.0.0.1", server.port)).expect("it listens"))
        .collect();
    for _ in 0..50 {
        let mut stream = TcpStream::connect(("127.0.0.1", server.port)).expect("it listens");
        let first = "GET /answers?where=quality%3E1 HTTP/1.1";
        let _ = write!(stream, "{first}\r\n{host}\r\n{token}\r\n\r\n");
    }
    assert_eq!(server.get("/boundary?share=0").status, 200);
    drop(silent);
    for (path, word) in [
        ("/boundary", "share"),
        ("/boundary?share=x", "share"),
        ("/boundary?share=-1", "share"),
        ("/boundary?share=7", "share"),
        ("/boundary?share=0&share=0", "share"),
        ("/boundary?share=0&other=1", "other"),
        ("/section", "plane"),
        ("/section?plane=0,0,0,1,0", "plane"),
        ("/section?plane=0,0,0,0,0,0", "plane"),
        ("/section?plane=0,0,0,nan,0,1", "plane"),
        ("/section?plane=inf,0,0,1,0,1", "plane"),
        ("/section?plane=0,0,0,1,0,0&value=nothing", "nothing"),
        ("/answers", "where"),
        ("/answers?where=quality", "condition"),
        ("/answers?where=quality%20%3E%20six", "six"),
        ("/pick?ray=0,0,0,0,0,0", "ray"),
        ("/pick?ray=0,0,0,1,0,0&hidden=a", "hidden"),
    ] {
        let refused = server.get(path);
        assert_eq!(refused.status, 400, "{path}");
        assert!(refused.sentence().contains(word), "{path}: {}", refused.sentence());
    }
    assert!(server.child.try_wait().expect("a state").is_none(), "the server ended");
}

#[test]
fn pictures_are_what_queries_find() {
    // Enough chunks for several threads.
    let place = place_of("balls,count=60");
    let server = Server::start(&place, "a.tetdb --threads 2");
    let single = Server::start(&place, "a.tetdb --threads 1 --memory 64MiB");
    let info = place.run_line("info a.tetdb --json").succeeds().json();
    let boundary = server.get("/boundary?share=0").line();
    let n = info["subdomains"].as_array().expect("a list").iter();
    let n: u64 = n.filter_map(|s| s["input_triangles"].as_u64().or(s["facets"].as_u64())).sum();
    assert!(n > 0);
    assert_eq!(boundary["of"], n, "{boundary}");
    let walls = server.get("/interfaces?share=0").line();
    assert_eq!(walls["shown"], info["interfaces"][0]["faces"]);

    let rows = |line: &str| -> Vec<Value> {
        let text = place.run_line(line).succeeds().stdout();
        text.lines().map(|line| serde_json::from_str(line).expect("JSON")).collect()
    };
    let plane = "0.41,0.5,0.5,1,0.3,-0.2";
    // The sides of the surface, for the excess, need memory that files of fields held.
    for value in ["quality", "T", "volume", "excess"] {
        let path = format!("/section?plane={plane}&value={value}");
        let cut = server.get(&path);
        assert!(cut.body == single.get(&path).body, "threads and memory change {value}");
        let found = rows(&format!("query a.tetdb --plane {plane} --select {value} --json"));
        let line = cut.line();
        assert_eq!(line["tets"], found.len(), "{value}");
        let mut wanted: Vec<f32> =
            found.iter().filter_map(|row| Some(row[value].as_f64()? as f32)).collect();
        let mut drawn = cut.values();
        for list in [&mut wanted, &mut drawn] {
            list.sort_by(f32::total_cmp);
            list.dedup();
        }
        // A plane through a vertex alone draws nothing of its tetrahedron.
        assert!(drawn.iter().all(|x| wanted.binary_search_by(|y| y.total_cmp(x)).is_ok()));
        assert!(drawn.len() * 10 > wanted.len() * 9, "{} of {}", drawn.len(), wanted.len());
    }
    for most in ["0.4", "9"] {
        let path = format!("/answers?where=quality+%3E+1.3+and+T+%3C+{most}&value=T");
        let answers = server.get(&path).line();
        let condition = format!("quality > 1.3 and T < {most}");
        let found = place.run(&["query", "a.tetdb", "--where", &condition, "--json"]);
        let n = found.succeeds().stdout().lines().count();
        assert_eq!(answers["tets"], n);
        let drawn = answers["drawn"].as_u64().expect("a number") as usize;
        match n <= 20_000 {
            true => assert!(drawn == n && n > 10),
            false => assert!((10_000..=20_000).contains(&drawn) && most == "9", "{drawn} of {n}"),
        }
    }

    let clip = "0.5,0.5,0.5,1,0,0";
    let path = format!("/pick?ray=3,0.31,0.42,-1,0,0&clip={clip}");
    let picked = server.get(&path).json();
    assert_eq!(picked, single.get(&path).json());
    assert!((picked["point"][0].as_f64().expect("a number") - 0.5).abs() < 1e-9);
    let located = rows("query a.tetdb --point 0.4999999,0.31,0.42 --select id --json");
    assert_eq!(picked["id"], located[0]["id"]);
    let id = picked["id"].as_str().expect("an id");
    let row = rows(&format!("query a.tetdb --tet {id} --select id,quality,T --json"));
    assert_eq!(picked["quality"], row[0]["quality"]);
    assert_eq!(picked["fields"], serde_json::json!([["T", row[0]["T"]]]));
    let rank = picked["subdomain"].as_u64().expect("a number");
    let behind = server.get(&format!("{path}&hidden={rank}")).json();
    assert!(behind.is_null() || behind["subdomain"] != rank);
    assert!(server.get("/pick?ray=3,3,3,1,0,0").json().is_null());
}

#[test]
#[cfg(unix)]
fn a_signal_ends_it_while_an_answer_is_under_way() {
    let place = place();
    for signal in ["-INT", "-TERM"] {
        let mut server = Server::start(&place, "a.tetdb");
        let first = format!("GET /answers?where=quality%3E1 HTTP/1.1\r\n{}\r\n", server.host());
        let mut stream = TcpStream::connect(("127.0.0.1", server.port)).expect("it listens");
        let _ = write!(stream, "{first}X-Tetdb-Token: {}\r\n\r\n", server.token);
        let id = server.child.id().to_string();
        let sent = Command::new("kill").args([signal, &id]).status().expect("kill is there");
        assert!(sent.success());
        let since = Instant::now();
        let exit = loop {
            if let Some(exit) = server.child.try_wait().expect("a state") {
                break exit;
            }
            assert!(since.elapsed() < Duration::from_secs(20), "{signal} does not end it");
            std::thread::sleep(Duration::from_millis(20));
        };
        assert_eq!(exit.code(), Some(0), "{signal}");
    }
    // A port in use, a version that is not there.
    let server = Server::start(&place, "a.tetdb");
    let line = format!("view a.tetdb --no-open --port {}", server.port);
    let refused = place.run_line(&line);
    assert!(refused.stderr().contains(&server.port.to_string()), "{}", refused.stderr());
    assert_ne!(refused.exit(), Some(0));
    assert_ne!(place.run_line("view a.tetdb --no-open --at-version none").exit(), Some(0));
    assert_ne!(place.run_line("view none.tetdb --no-open").exit(), Some(0));
}
