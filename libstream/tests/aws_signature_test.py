# SPDX-License-Identifier: Apache-2.0
"""Compares the signatures of sign_requests with those of botocore, for random requests with odd keys."""
import hashlib
import json
import os
import random
import subprocess
import sys
import unittest
import warnings

try:
    import botocore.auth
    from botocore.awsrequest import AWSRequest
    from botocore.credentials import Credentials
except ImportError:
    botocore = None

SIGNER = os.environ['SIGNER']
REQUESTS = 3000
TIME = '20261128T120000Z'
LETTERS = "abcXYZ019-_.~!*'();:@&=+$,?%#[] /äß漢😀\"<>^`{|}\\"


def text(rng, most, least=0):
    return ''.join(rng.choice(LETTERS) for _ in range(rng.randint(least, most)))


def random_request(rng):
    names = ['prefix', 'list-type', 'partNumber', 'uploadId', 'uploads', 'delimiter', 'a b', 'ä']
    headers = {'range': f'bytes={rng.randint(0, 9)}-{rng.randint(10, 99)}'}
    if rng.random() < 0.3:
        headers['x-amz-request-payer'] = 'requester'
    if rng.random() < 0.3:
        headers['if-match'] = '"' + ''.join(rng.choice('0123456789abcdef  ') for _ in range(8)) + '"'
    return {
        'method': rng.choice(['GET', 'PUT', 'HEAD', 'POST', 'DELETE']),
        'host': rng.choice(['s3.example.org', 'b.s3.eu-central-1.amazonaws.com', '127.0.0.1:9000']),
        'path': '/' + text(rng, 12),
        'query': [[name, text(rng, 6)] for name in rng.sample(names, rng.randint(0, 3))],
        'headers': headers,
        'body': text(rng, 5),
        'key_id': 'AKIDEXAMPLE',
        'secret': text(rng, 40, 1),
        'token': text(rng, 20).strip() if rng.random() < 0.3 else '',
        'region': rng.choice(['us-east-1', 'eu-central-1']),
        'time': TIME,
    }


@unittest.skipIf(botocore is None, 'python3-botocore is not installed')
class AwsSignature(unittest.TestCase):
    def signature_of_botocore(self, request, target):
        """The time at which botocore signs, by its own clock, and the header Authorization."""
        body = request['body'].encode()
        aws = AWSRequest(request['method'], 'http://' + request['host'] + target, data=body,
                         headers={**request['headers'], 'x-amz-content-sha256': hashlib.sha256(body).hexdigest()})
        aws.context['client_config'] = None
        # botocore sends the hash of the body only over https; both sign the same request here.
        aws.context['payload_signing_enabled'] = True
        credentials = Credentials(request['key_id'], request['secret'], request['token'] or None)
        botocore.auth.S3SigV4Auth(credentials, 's3', request['region']).add_auth(aws)
        return aws.headers['X-Amz-Date'], aws.headers['Authorization']

    def answers(self, requests):
        """Of each request its target and its header Authorization."""
        lines = ''.join(json.dumps(request) + '\n' for request in requests)
        out = subprocess.run([SIGNER], input=lines.encode(), stdout=subprocess.PIPE, check=True).stdout.decode()
        answers = out.splitlines()
        self.assertEqual(len(answers), 2 * len(requests))
        return list(zip(answers[::2], answers[1::2]))

    def test_signatures_equal_those_of_botocore(self):
        warnings.simplefilter('ignore')
        seed = random.randrange(1 << 32)
        rng = random.Random(seed)
        requests = [random_request(rng) for _ in range(REQUESTS)]
        expected = []
        for request, (target, _) in zip(requests, self.answers(requests)):
            request['time'], authorization = self.signature_of_botocore(request, target)
            expected.append((target, authorization))
        for request, answer, wanted in zip(requests, self.answers(requests), expected):
            self.assertEqual(answer, wanted, f'seed {seed}, request {request}')


if __name__ == '__main__':
    unittest.main(argv=sys.argv)
