# SPDX-License-Identifier: Apache-2.0
# The compiled half is private. Its functions have no types; those that call them have.
from typing import Any

def __getattr__(name: str) -> Any: ...
