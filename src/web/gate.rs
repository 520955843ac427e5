//! Who is let in: every request passes here before it reaches a page.

use std::sync::Arc;

use axum::extract::{Request, State};
use axum::http::header::{self, HeaderMap, HeaderName, HeaderValue};
use axum::http::{StatusCode, Uri};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};

use super::connections::Visitor;
use super::{MAX_BODY, Token};

/// What a request is held against.
#[derive(Debug)]
pub(super) struct Gate {
    /// The names under which a browser on this machine finds the server, as in `127.0.0.1:8000`.
    hosts: [String; 2],
    token: Token,
}

/// Why a request is refused.
type Refusal = (StatusCode, &'static str);

impl Gate {
    pub(super) fn new(port: u16, token: Token) -> Gate {
        Gate { hosts: ["127.0.0.1", "localhost"].map(|name| format!("{name}:{port}")), token }
    }

    fn check(&self, uri: &Uri, headers: &HeaderMap) -> Result<(), Refusal> {
        let host = self.host(uri, headers).ok_or((StatusCode::FORBIDDEN, "not under this host name"))?;
        // A page of another site may send requests here, even if it cannot read the answers.
        let foreign = (StatusCode::FORBIDDEN, "not from another site");
        let mut origins = headers.get_all(header::ORIGIN).iter();
        if !origins.all(|origin| origin.as_bytes().strip_prefix(b"http://") == Some(host.as_bytes())) {
            return Err(foreign);
        }
        let mut sites = headers.get_all("sec-fetch-site").iter();
        if !sites.all(|site| site == "same-origin" || site == "none") {
            return Err(foreign);
        }
        let first = uri.path().split('/').nth(1).unwrap_or_default();
        if !self.token.is(first) {
            let text = "the address is not complete: open the one that the command has printed";
            return Err((StatusCode::FORBIDDEN, text));
        }
        let length = headers.get(header::CONTENT_LENGTH).and_then(|l| l.to_str().ok()?.parse::<u64>().ok());
        if length.is_some_and(|length| length > MAX_BODY as u64) {
            return Err((StatusCode::PAYLOAD_TOO_LARGE, "too much at once"));
        }
        Ok(())
    }

    /// The host that the request names, if it is one of ours: a name of an attacker's may have been pointed to
    /// 127.0.0.1.
    fn host(&self, uri: &Uri, headers: &HeaderMap) -> Option<&String> {
        let mut named = headers.get_all(header::HOST).iter();
        let first = named.next()?;
        let host = self.hosts.iter().find(|host| first == host.as_str())?;
        let same = uri.authority().is_none_or(|authority| authority.as_str() == host);
        (named.next().is_none() && same).then_some(host)
    }
}

/// Lets a request through or refuses it, and tells the browser what the answer may do.
pub(super) async fn guard(State(gate): State<Arc<Gate>>, request: Request, next: Next) -> Response {
    let mut response = match gate.check(request.uri(), request.headers()) {
        Ok(()) => {
            request.extensions().get::<Visitor>().inspect(|visitor| visitor.let_in());
            next.run(request).await
        }
        Err(refusal) => refusal.into_response(),
    };
    for (name, value) in headers() {
        response.headers_mut().insert(name, HeaderValue::from_static(value));
    }
    response
}

/// Nothing from elsewhere, nothing to elsewhere, nothing kept.
fn headers() -> [(HeaderName, &'static str); 7] {
    [
        (
            header::CONTENT_SECURITY_POLICY,
            "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; connect-src 'self'; \
         base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
        ),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
        (header::CACHE_CONTROL, "no-store"),
        (header::X_FRAME_OPTIONS, "DENY"),
        (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
        (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(path: &str, headers: &[(&'static str, &str)]) -> Result<(), u16> {
        let gate = Gate::new(8000, "0123456789abcdef0123456789abcdef".parse().expect("a token"));
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            map.append(*name, value.parse().expect("a value"));
        }
        gate.check(&path.parse().expect("a path"), &map).map_err(|(status, _)| status.as_u16())
    }

    #[test]
    fn only_our_own_pages_get_in() {
        let path = "/0123456789abcdef0123456789abcdef/";
        let host = ("host", "127.0.0.1:8000");
        assert_eq!(check(path, &[host]), Ok(()));
        assert_eq!(check(path, &[("host", "localhost:8000"), ("origin", "http://localhost:8000")]), Ok(()));
        assert_eq!(check(path, &[host, ("sec-fetch-site", "same-origin")]), Ok(()));
        for wrong in [
            vec![],
            vec![("host", "127.0.0.1")],
            vec![("host", "127.0.0.1:8001")],
            vec![("host", "attacker.example:8000")],
            vec![host, ("host", "attacker.example")],
            vec![host, ("origin", "http://attacker.example")],
            vec![host, ("origin", "http://localhost:8000")],
            vec![host, ("origin", "https://127.0.0.1:8000")],
            vec![host, ("origin", "null")],
            vec![host, ("sec-fetch-site", "cross-site")],
            vec![host, ("sec-fetch-site", "same-site")],
        ] {
            assert_eq!(check(path, &wrong), Err(403), "{wrong:?}");
        }
        for path in ["/", "/x/", "/0123456789abcdef0123456789abcdee/", "//0123456789abcdef0123456789abcdef/"]
        {
            assert_eq!(check(path, &[host]), Err(403), "{path}");
        }
        assert_eq!(check("http://attacker.example/0123456789abcdef0123456789abcdef/", &[host]), Err(403));
        assert_eq!(check(path, &[host, ("content-length", "65536")]), Ok(()));
        assert_eq!(check(path, &[host, ("content-length", "65537")]), Err(413));
    }
}
