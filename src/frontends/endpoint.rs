use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

/// Where the gateway listens.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Endpoint {
    /// On this machine's loopback alone. Port 0 takes a free one.
    Loopback(SocketAddr),
    /// A local socket file.
    Ipc(String),
}

/// Why the gateway will not listen there.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EndpointError {
    #[error(
        "{endpoint:?} is no endpoint; expected tcp://127.0.0.1:PORT, tcp://[::1]:PORT or ipc://PATH"
    )]
    Form { endpoint: String },
    #[error(
        "{endpoint} would be open to the network, and this version cannot tell who is knocking; \
         listen on tcp://127.0.0.1:PORT and let people in through a tunnel"
    )]
    NotLoopback { endpoint: String },
    #[error("the path of {endpoint:?} has {found} bytes; a local socket's path has at most {max}")]
    PathTooLong { endpoint: String, found: usize, max: usize },
}

/// Bytes of a local socket's path (`sockaddr_un.sun_path`, its closing zero left out).
const IPC_PATH_BYTES_MAX: usize = 107;

impl Endpoint {
    /// - errors: no endpoint at all; or one that others than this machine could reach. Until keys
    ///   exist, whoever can connect can be anyone.
    pub fn parse(text: &str) -> Result<Endpoint, EndpointError> {
        let form = || EndpointError::Form { endpoint: text.chars().take(120).collect() };
        if let Some(path) = text.strip_prefix("ipc://") {
            if path.is_empty() || path.contains('\0') {
                return Err(form());
            }
            if path.len() > IPC_PATH_BYTES_MAX {
                return Err(EndpointError::PathTooLong {
                    endpoint: text.to_owned(),
                    found: path.len(),
                    max: IPC_PATH_BYTES_MAX,
                });
            }
            return Ok(Endpoint::Ipc(path.to_owned()));
        }
        let address = text.strip_prefix("tcp://").ok_or_else(form)?;
        let (host, port) = address.rsplit_once(':').ok_or_else(form)?;
        let port: u16 = match port {
            "*" => 0,
            port => port.parse().map_err(|_| form())?,
        };
        let host = match host {
            // Written out, so that no name service can say otherwise.
            "localhost" => IpAddr::V4(Ipv4Addr::LOCALHOST),
            host => match host.trim_start_matches('[').trim_end_matches(']').parse() {
                Ok(host) => host,
                Err(_) => return Err(EndpointError::NotLoopback { endpoint: text.to_owned() }),
            },
        };
        match host.is_loopback() {
            true => Ok(Endpoint::Loopback(SocketAddr::new(host, port))),
            false => Err(EndpointError::NotLoopback { endpoint: text.to_owned() }),
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Endpoint::Loopback(address) => write!(f, "tcp://{address}"),
            Endpoint::Ipc(path) => write!(f, "ipc://{path}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn loopback_and_local_sockets_are_listened_on() {
        for (text, read) in [
            ("tcp://127.0.0.1:5555", "tcp://127.0.0.1:5555"),
            ("tcp://127.0.0.1:*", "tcp://127.0.0.1:0"),
            ("tcp://localhost:0", "tcp://127.0.0.1:0"),
            ("tcp://[::1]:7", "tcp://[::1]:7"),
            ("ipc:///run/apprentice.sock", "ipc:///run/apprentice.sock"),
        ] {
            assert_eq!(Endpoint::parse(text).unwrap().to_string(), read);
        }
    }

    #[test]
    fn what_the_network_could_reach_is_refused() {
        for text in ["tcp://*:5555", "tcp://0.0.0.0:5555", "tcp://192.168.1.4:1", "tcp://eth0:1"] {
            let error = Endpoint::parse(text).unwrap_err();
            assert!(matches!(error, EndpointError::NotLoopback { .. }), "{text}: {error}");
        }
    }

    #[test]
    fn nonsense_is_refused() {
        for text in ["", "127.0.0.1:5", "tcp://127.0.0.1", "tcp://127.0.0.1:99999", "ipc://"] {
            let error = Endpoint::parse(text).unwrap_err();
            assert!(matches!(error, EndpointError::Form { .. }), "{text}: {error}");
        }
        let long = format!("ipc:///{}", "x".repeat(200));
        assert!(matches!(Endpoint::parse(&long), Err(EndpointError::PathTooLong { .. })));
    }
}
