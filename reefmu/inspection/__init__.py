"""What a measured record holds, before anything is fitted to it.

sampling -> diagnosability -> record_inspection -> inspection_text
"""

from .inspection_text import inspection_text
from .record_inspection import RecordInspection, inspect_record

__all__ = ["RecordInspection", "inspect_record", "inspection_text"]
