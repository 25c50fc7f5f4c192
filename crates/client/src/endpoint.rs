use std::fmt;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};

/// Where a service listens, and where clients connect.
///
/// ```
/// use apprentice_client::Endpoint;
///
/// let endpoint = Endpoint::parse("tcp://localhost:7117")?;
/// assert_eq!(endpoint.to_string(), "tcp://127.0.0.1:7117");
/// assert!(Endpoint::parse("localhost:7117").is_err(), "the transport is missing");
/// // Other machines can reach this address, so a service listens there with keys only.
/// assert!(Endpoint::parse_open("tcp://192.0.2.1:7117").is_err());
/// # Ok::<(), apprentice_client::EndpointError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Endpoint {
    /// An address that only this machine can reach. A service that listens at port 0 takes a free
    /// port.
    Loopback(SocketAddr),
    /// The path of a local socket.
    Ipc(String),
    /// An address that other machines can reach.
    Network {
        /// An IP address, or the name of a host or of a network card. IPv6 in square brackets.
        host: String,
        /// Port 0: a service that listens takes a free port.
        port: u16,
    },
}

/// Why a text is not an endpoint, or must not be used as one.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum EndpointError {
    /// It is not written as an endpoint.
    #[error(
        "{endpoint:?} is not an endpoint; expected tcp://ADDRESS:PORT, such as tcp://127.0.0.1:7117, or \
         ipc://PATH"
    )]
    Form {
        /// The first characters of the text.
        endpoint: String,
    },
    /// A service without keys must listen where only this machine can reach it.
    #[error(
        "{endpoint} would be open to the network, where anyone could speak for every user; use keys \
         (`--curve {endpoint}`), or listen on tcp://127.0.0.1:PORT"
    )]
    NotLoopback {
        /// The text.
        endpoint: String,
    },
    /// A client without a key must connect to this machine.
    #[error(
        "{endpoint} is on another machine, so you need keys; name your key with --key FILE and the \
         service's key with --server-key KEY"
    )]
    KeyWanted {
        /// The text.
        endpoint: String,
    },
    /// The operating system does not take a path that long.
    #[error("the path of {endpoint:?} has {found} bytes; the limit for a local socket is {max}")]
    PathTooLong {
        /// The text.
        endpoint: String,
        /// Bytes of the path.
        found: usize,
        /// Bytes that it may have.
        max: usize,
    },
}

/// Bytes of the path of a local socket: `sockaddr_un.sun_path` without its closing zero.
const IPC_PATH_BYTES_MAX: usize = 107;

/// Bytes of the name of a host (RFC 1035).
const HOST_BYTES_MAX: usize = 253;

impl Endpoint {
    /// Reads `tcp://HOST:PORT` or `ipc://PATH`. The port `*` is port 0, and the host `*` means all
    /// addresses of the machine.
    ///
    /// - errors: it is not written as an endpoint, or its path is too long.
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
        let literal = host.strip_prefix('[').and_then(|host| host.strip_suffix(']'));
        let read = match (literal, host) {
            (Some(literal), _) => Some(IpAddr::V6(literal.parse().map_err(|_| form())?)),
            // As an address, so that no name service can change it.
            (None, "localhost") => Some(IpAddr::V4(Ipv4Addr::LOCALHOST)),
            (None, "*") => Some(IpAddr::V4(Ipv4Addr::UNSPECIFIED)),
            (None, host) => host.parse::<Ipv4Addr>().ok().map(IpAddr::V4),
        };
        match read {
            Some(address) if address.is_loopback() => {
                Ok(Endpoint::Loopback(SocketAddr::new(address, port)))
            }
            Some(IpAddr::V6(address)) => {
                Ok(Endpoint::Network { host: format!("[{address}]"), port })
            }
            Some(IpAddr::V4(address)) => Ok(Endpoint::Network { host: address.to_string(), port }),
            None => {
                let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '.' | '-' | '_');
                let is_name = !host.is_empty() && host.len() <= HOST_BYTES_MAX;
                match is_name && host.chars().all(plain) {
                    true => Ok(Endpoint::Network { host: host.to_owned(), port }),
                    false => Err(form()),
                }
            }
        }
    }

    /// Reads an endpoint for a service without keys. Everybody who can connect there can speak for
    /// every user, so only this machine may reach it.
    ///
    /// - errors: as [`Endpoint::parse`], or other machines could reach it.
    pub fn parse_open(text: &str) -> Result<Endpoint, EndpointError> {
        match Endpoint::parse(text)? {
            Endpoint::Network { .. } => {
                Err(EndpointError::NotLoopback { endpoint: text.to_owned() })
            }
            endpoint => Ok(endpoint),
        }
    }

    /// True if a socket for it must use IPv6.
    pub fn is_ipv6(&self) -> bool {
        match self {
            Endpoint::Loopback(address) => address.is_ipv6(),
            Endpoint::Network { host, .. } => host.starts_with('['),
            Endpoint::Ipc(_) => false,
        }
    }
}

impl fmt::Display for Endpoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Endpoint::Loopback(address) => write!(f, "tcp://{address}"),
            Endpoint::Ipc(path) => write!(f, "ipc://{path}"),
            Endpoint::Network { host, port } => write!(f, "tcp://{host}:{port}"),
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
    fn what_the_network_could_reach_is_not_open() {
        for (text, read) in [
            ("tcp://*:5555", "tcp://0.0.0.0:5555"),
            ("tcp://192.168.1.4:1", "tcp://192.168.1.4:1"),
            ("tcp://[2001:db8::1]:2", "tcp://[2001:db8::1]:2"),
            ("tcp://[::]:2", "tcp://[::]:2"),
            ("tcp://eth0:1", "tcp://eth0:1"),
            ("tcp://robot.lab-7.example:7117", "tcp://robot.lab-7.example:7117"),
            // A name that only looks like loopback.
            ("tcp://127.0.0.1.example:1", "tcp://127.0.0.1.example:1"),
        ] {
            assert_eq!(Endpoint::parse(text).unwrap().to_string(), read);
            let error = Endpoint::parse_open(text).unwrap_err();
            assert!(matches!(error, EndpointError::NotLoopback { .. }), "{text}: {error}");
        }
        assert!(Endpoint::parse_open("tcp://127.0.0.1:5555").is_ok());
    }

    #[test]
    fn nonsense_is_refused() {
        let texts = ["", "127.0.0.1:5", "tcp://127.0.0.1", "tcp://127.0.0.1:99999", "ipc://"];
        for text in
            texts.into_iter().chain(["tcp://:1", "tcp://a b:1", "tcp://[::1:1", "tcp://a;b:1"])
        {
            let error = Endpoint::parse(text).unwrap_err();
            assert!(matches!(error, EndpointError::Form { .. }), "{text}: {error}");
        }
        let long = format!("ipc:///{}", "x".repeat(200));
        assert!(matches!(Endpoint::parse(&long), Err(EndpointError::PathTooLong { .. })));
    }
}
