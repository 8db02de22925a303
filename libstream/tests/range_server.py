# SPDX-License-Identifier: Apache-2.0
"""A small HTTP server for tests, which serves ranges of files in memory, counts requests and fails on demand."""
import hashlib
import http.server
import re
import socket
import socketserver
import struct
import threading
import urllib.parse


class RangeServer:
    """Serves `files`, bytes by path ("/store/manifest.json"). Attributes that tests set:

    - ranges: False answers 200 with the whole file.
    - etags: 'strong', 'weak' or 'none'; with 'none' there is a Last-Modified.
    - checks_match: whether If-Match is heeded.
    - answers: statuses of the next requests, before the files are served again; 'cut' sends half of the body, 'reset' closes
      the connection, 'short' sends fewer bytes than Content-Range says.
    - access: a function (handler) -> status, or None to serve the file.
    """

    def __init__(self, files):
        self.files = dict(files)
        self.ranges = True
        self.etags = 'strong'
        self.checks_match = True
        self.answers = []
        self.access = None
        self.modified = 'Sat, 28 Nov 2026 12:00:00 GMT'
        self.lock = threading.Lock()
        self.clear()
        outer = self

        class Handler(http.server.BaseHTTPRequestHandler):
            protocol_version = 'HTTP/1.1'

            def log_message(self, *arguments):
                pass

            def setup(self):
                super().setup()
                with outer.lock:
                    outer.connections += 1

            def do_GET(self):
                outer.serve(self)

            do_PUT = do_POST = do_GET

        class Server(socketserver.ThreadingMixIn, http.server.HTTPServer):
            daemon_threads = True
            request_queue_size = 64

            def handle_error(self, request, address):
                pass

        self.server = Server(('127.0.0.1', 0), Handler)
        self.url = f'http://127.0.0.1:{self.server.server_port}'
        self.thread = threading.Thread(target=self.server.serve_forever, kwargs={'poll_interval': 0.02}, daemon=True)
        self.thread.start()

    def clear(self):
        """Forgets the requests so far."""
        self.requests = []  # (path, first byte, end, headers)
        self.sent = 0
        self.connections = 0

    def close(self):
        self.server.shutdown()
        self.server.server_close()

    def serve(self, handler):
        length = int(handler.headers.get('Content-Length') or 0)
        handler.body = handler.rfile.read(length)
        path = urllib.parse.unquote(handler.path.partition('?')[0])
        wanted = re.fullmatch(r'bytes=(\d+)-(\d+)', handler.headers.get('Range', ''))
        first, end = (int(wanted[1]), int(wanted[2]) + 1) if wanted else (0, None)
        with self.lock:
            self.requests.append((path, first, end, dict((k.lower(), v) for k, v in handler.headers.items())))
            answer = self.answers.pop(0) if self.answers else None
        if answer is None and self.access is not None:
            answer = self.access(handler)
            if answer == 'done':
                return
        if answer == 'reset':
            handler.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack('ii', 1, 0))
            handler.close_connection = True
            handler.connection.close()
            return
        if isinstance(answer, int):
            self.send(handler, answer, b'an error')
            return
        if path not in self.files:
            self.send(handler, 404, b'nothing here')
            return
        data = self.files[path]
        headers = {'Last-Modified': self.modified}
        etag = '"' + hashlib.md5(data).hexdigest() + '"'
        if self.etags != 'none':
            headers['ETag'] = ('W/' if self.etags == 'weak' else '') + etag
        match = handler.headers.get('If-Match')
        if match is not None and self.checks_match and match != etag:
            self.send(handler, 412, b'', headers)
        elif not self.ranges or not wanted:
            self.send(handler, 200, data, headers, answer)
        elif first >= len(data):
            self.send(handler, 416, b'', {**headers, 'Content-Range': f'bytes */{len(data)}'})
        else:
            end = min(end, len(data))
            headers['Content-Range'] = f'bytes {first}-{end - 1}/{len(data)}'
            self.send(handler, 206, data[first:end], headers, answer)

    def send(self, handler, status, body, headers=None, fault=None):
        handler.send_response(status)
        for name, value in (headers or {}).items():
            handler.send_header(name, value)
        part = body[:len(body) // 2] if fault in ('cut', 'short') else body
        handler.send_header('Content-Length', str(len(part if fault == 'short' else body)))
        handler.end_headers()
        with self.lock:
            self.sent += len(part)
        try:
            handler.wfile.write(part)
        except OSError:
            pass
        if fault == 'cut':
            handler.close_connection = True
